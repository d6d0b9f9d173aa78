from pathlib import Path

from snakemake.utils import min_version

from reacher_shaping.settings.overview import overview
from reacher_shaping.settings.study import settings_hash

min_version("9.0")

HERE = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))  # also where another workflow imports this one


include: "workflow/rules/common.smk"


STUDY = or_stop(read_study)
SETTINGS_HASH = settings_hash(STUDY)


onstart:
    take_folder()
    watch()


onsuccess:
    remove_finished_checkpoints()
    CheckpointStore(STORE).clear()


onerror:
    remove_finished_checkpoints()


include: "workflow/rules/cells.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/resources.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/evaluate.smk"
include: "workflow/rules/peers.smk"
include: "workflow/rules/analyse.smk"
include: "workflow/rules/judge.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/search.smk"
include: "workflow/rules/notebooks.smk"
include: "workflow/rules/media.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/publish.smk"
include: "workflow/rules/watch.smk"


# Intermediate files are named here too: a changed job that failed has lost its outputs, and without them in the
# targets a later call would find the old tables and have nothing to do (snakemake issue 1978).
rule all:
    default_target: True
    input:
        BLOCK_FILES,
        tables_of(MAIN),
        RUN_RADII,
        FORMATTED_TABLES,
        NOTEBOOKS,
        MEDIA,
        SHOWN_FILES,
        "results/check.txt",
        [path for name in MADE for path in runs_of(name)],
        figures_of(MADE),
        "report/report.html",
        "report/report.pdf",
        CRATE,


# The last rules, so that the names of all others are known.
for name in STUDY.experiments:
    if workflow.is_rule(name):
        sys.exit(f"ConfigError: config: experiments: {name!r} is the name of a rule; allowed: any other name")

    rule:
        name:
            name
        input:
            runs_of(name),
            tables_of(name),
            f"results/experiments/{name}/check.txt",
            figures_of([name]),


if workflow.output_settings.stdout and not workflow.output_settings.quiet:  # a dry run, whose words go there
    print(overview(STUDY))
