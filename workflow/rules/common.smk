# Functions that several stages share.
import json
import os
import sys

from reacher_shaping.settings.base import ConfigError
from reacher_shaping.storage.code_hash import code_hash

os.environ.update(OMP_NUM_THREADS="1")  # one thread a job; Snakemake fills the cores with jobs


def or_stop(read, settings):
    """What `read` makes of the settings; where they are wrong, end with its one line and no traceback."""
    try:
        return read(settings)
    except ConfigError as error:
        sys.exit(f"ConfigError: {error}")


def source(path):
    """A file of the repository, relative to the working directory, so that a moved clone reruns nothing."""
    return os.path.relpath(HERE / path)


WORDS = source("src/reacher_shaping/report/text.yaml")


def code(script):
    """Hash of the code a script runs: a param, so that an edit of that code and nothing else reruns its jobs."""
    return code_hash(HERE / "workflow/scripts" / f"{script}.py")


def as_json(settings):
    return json.dumps(settings, sort_keys=True)
