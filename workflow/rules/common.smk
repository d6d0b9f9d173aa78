# Functions that several stages share.
import atexit
import json
import os
import re
import shutil
import sys
from functools import cache

from reacher_shaping import processor
from reacher_shaping.jobs import folder_lock
from reacher_shaping.jobs.checkpoint_store import CheckpointStore
from reacher_shaping.settings.base import ConfigError, short
from reacher_shaping.settings.study import load_study, read_settings
from reacher_shaping.settings.yaml_file import merged
from reacher_shaping.storage.code_hash import code_hash
from reacher_shaping.storage.tables import TABLES, made_by

UNFIT = set(" \t'\"$`\\;&|<>(){}[]*?!#") & set(sys.executable)  # Snakemake starts scripts by a shell, unquoted
if UNFIT:
    sys.exit(f"{sys.executable}: Snakemake starts no job by a Python with {min(UNFIT)!r} in its path; move the clone")


def or_stop(read):
    """What `read` makes of the settings; where they are wrong, end with its one line and no traceback."""
    try:
        return read()
    except ValueError as error:
        sys.exit(f"ConfigError: {error}")
    except folder_lock.FolderTakenError as error:
        sys.exit(str(error))


def take_folder():
    """One Snakemake at a time works in a folder; another is told which one does."""
    atexit.register(folder_lock.release, or_stop(lambda: folder_lock.hold(Path())))


def remove_finished_checkpoints():
    """Training jobs keep their last checkpoint until Snakemake has recorded all outputs (see `jobs.training_job`)."""
    incomplete = Path(".snakemake/incomplete")
    if not incomplete.is_dir() or not any(incomplete.iterdir()):
        for mark in Path("results/.checkpoints").glob("*/finished"):
            shutil.rmtree(mark.parent)


def read_study():
    """config.yaml with what `--configfile`, `--config` and a workflow that imports this one lay over it.

    `kernels` is none of the study's settings but the machine's, so it comes by `--config` or from a profile alone: it
    goes into the environment of the jobs, as their one thread does.

    There is no `configfile:`, since Snakemake reads YAML 1.1, in which 010 is 8; so the files are read here again.
    """
    single = workflow.config_settings.config
    for key, value in single.items():
        if isinstance(value, (dict, list)):
            wanted = "allowed: a single value; write this one into a file and name it with --configfile"
            raise ConfigError(f"--config {key} = {short(value)}: {wanted}")
    overlays = read_settings(*workflow.overwrite_configfiles)
    settings = merged(read_settings(HERE / "config.yaml"), config, overlays, single)
    processor.fix(settings.pop("kernels", "portable"))
    return load_study(settings)


def source(path):
    """A file of the repository, relative to the working directory, so that a moved clone reruns nothing.

    It lies with the workflow, wherever `--default-storage-provider` puts the study's files.
    """
    return local(os.path.relpath(HERE / path))


# Where the study's files go if not to this disk, such as s3://bucket/study; training jobs keep their checkpoints there too.
STORE = workflow.storage_settings.default_storage_prefix or "" if workflow.storage_settings else ""


def made(path):
    """Whether a file of the study is there already, on this disk or in the store, below the prefix of a module."""
    return exists(workflow.modifier.path_modifier.replace_prefix(path))


WORDS = source("src/reacher_shaping/report/text.yaml")


@cache
def code(script, chosen=()):
    """Hash of the code a script runs: a param, so that an edit of that code and nothing else reruns its jobs.

    `chosen` is what the script looks up by name, for a cell's job its own task, potential and schedule.
    """
    return code_hash(HERE / "workflow/scripts" / f"{script}.py", chosen)


def one_of(names):
    """A wildcard's constraint: these names alone, so that any other is a file that no rule makes."""
    escaped = [re.escape(name) for name in names]  # that of the main study's folder is empty
    return f"(?:{'|'.join(escaped)})" if escaped else "(?!)"


def as_json(settings):
    return json.dumps(settings, sort_keys=True)
