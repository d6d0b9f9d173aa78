# The further studies of config.yaml, each an optional target of its name: `snakemake attribution`. Once made, they are
# part of the report.
from reacher_shaping.views import NAMES as VIEWS
from reacher_shaping.views import views


def of_experiment(make):
    """A param or input made of the cells and seeds of the experiment named by the wildcard."""
    return lambda wildcards: make(EXPERIMENTS[wildcards.experiment], STUDY.experiments[wildcards.experiment].seeds)


def of_blocks(file):
    return of_experiment(lambda cells, seeds: [f"{block}/{file}" for block in blocks(cells, seeds)])


def protocols_of(cells, seeds=None):
    """The settings of the cells' protocols, each once."""
    return as_json(list({cell.protocol.name: cell.protocol.model_dump() for cell in cells}.values()))


def peers_of(experiment):
    """Runs of other algorithms that an experiment asks for."""
    peers = STUDY.experiments[experiment].peers
    path = f"results/experiments/{experiment}/peers/{{algorithm}}/seed{{seed}}.parquet"
    return expand(path, algorithm=peers.budgets, seed=range(peers.seeds)) if peers else []


def views_of(experiment):
    """Names of an experiment's figures."""
    keys = [cell.key for cell in EXPERIMENTS[experiment]]
    return views(keys, switches=STUDY.experiments[experiment].switches is not None)


def figures_of(experiment):
    return expand("figures/{experiment}_{view}.{kind}", experiment=experiment, view=views_of(experiment), kind=KINDS)


def tables_of(experiment):
    """Names and files of an experiment's tables."""
    names = ["runs.parquet", "cells.parquet", "curves.parquet", "logs.parquet", "logged.parquet"]
    names += ["comparisons.parquet", "correlation.csv", "controllers.parquet"]
    names += ["effects.csv"] if STUDY.experiments[experiment].switches else []
    names += ["agreement.csv"] if STUDY.experiments[experiment].peers else []
    return {name.partition(".")[0]: f"results/experiments/{experiment}/{name}" for name in names}


# An experiment whose tables are there is part of the report.
MADE = [name for name in EXPERIMENTS if all(Path(path).exists() for path in tables_of(name).values())]
MADE_TABLES = [path for name in MADE for path in tables_of(name).values()]
MADE_FIGURES = [path for name in MADE for path in figures_of(name)]

# The main study's correlations stand beside an experiment's once they are there.
MAIN_CORRELATION = [path for path in ["results/correlation.csv"] if Path(path).exists()]


wildcard_constraints:
    experiment="|".join(EXPERIMENTS) or "none",
    view="|".join(VIEWS),


use rule aggregate_runs as aggregate_experiment with:
    input:
        progress=of_blocks("progress.parquet"),
        episodes=of_blocks("episodes.parquet"),
    output:
        runs="results/experiments/{experiment}/runs.parquet",
        cells="results/experiments/{experiment}/cells.parquet",
        curves="results/experiments/{experiment}/curves.parquet",
    log:
        "results/logs/experiments/{experiment}/aggregate.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/aggregate.tsv"
    params:
        cells=of_experiment(block_cells),
        root_seed=STUDY.root_seed,
        code=code("aggregate_runs"),


use rule evaluate_controllers as evaluate_experiment_controllers with:
    output:
        "results/experiments/{experiment}/controllers.parquet",
    log:
        "results/logs/experiments/{experiment}/controllers.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/controllers.tsv"
    params:
        evaluation=as_json(STUDY.evaluation.model_dump()),
        protocols=of_experiment(protocols_of),
        root_seed=STUDY.root_seed,
        code=code("evaluate_controllers"),


use rule train_peer as train_experiment_peer with:
    output:
        run="results/experiments/{experiment}/peers/{algorithm}/seed{seed}.parquet",
        manifest="results/experiments/{experiment}/peers/{algorithm}/seed{seed}.json",
    log:
        "results/logs/experiments/{experiment}/{algorithm}-{seed}.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/{algorithm}-{seed}.tsv"
    params:
        budget=lambda wildcards: STUDY.experiments[wildcards.experiment].peers.budgets[wildcards.algorithm],
        protocol=of_experiment(lambda cells, seeds: as_json(cells[0].protocol.model_dump())),
        evaluation=as_json(STUDY.evaluation.model_dump()),
        root_seed=STUDY.root_seed,
        code=code("train_peer"),


rule summarise_experiment:
    input:
        **PUBLISHED,
        runs="results/experiments/{experiment}/runs.parquet",
        progress=of_blocks("progress.parquet"),
    output:
        logs="results/experiments/{experiment}/logs.parquet",
        logged="results/experiments/{experiment}/logged.parquet",
        comparisons="results/experiments/{experiment}/comparisons.parquet",
        correlation="results/experiments/{experiment}/correlation.csv",
    log:
        "results/logs/experiments/{experiment}/summarise.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/summarise.tsv"
    threads: 1
    params:
        cells=of_experiment(block_cells),
        root_seed=STUDY.root_seed,
        code=code("summarise_experiment"),
    script:
        "../scripts/summarise_experiment.py"


rule measure_effects:
    input:
        runs="results/experiments/{experiment}/runs.parquet",
    output:
        "results/experiments/{experiment}/effects.csv",
    log:
        "results/logs/experiments/{experiment}/effects.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/effects.tsv"
    threads: 1
    params:
        switches=lambda wildcards: as_json(STUDY.experiments[wildcards.experiment].switches.model_dump()),
        protocols=of_experiment(protocols_of),
        root_seed=STUDY.root_seed,
        code=code("measure_effects"),
    script:
        "../scripts/measure_effects.py"


rule compare_with_peers:
    input:
        runs="results/experiments/{experiment}/runs.parquet",
        peers=lambda wildcards: peers_of(wildcards.experiment),
    output:
        "results/experiments/{experiment}/agreement.csv",
    log:
        "results/logs/experiments/{experiment}/agreement.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/agreement.tsv"
    threads: 1
    params:
        code=code("compare_with_peers"),
    script:
        "../scripts/compare_with_peers.py"


rule plot_experiment:
    input:
        lambda wildcards: tables_of(wildcards.experiment).values(),
        training_logs=source("report/published/training_logs.csv"),
        main=MAIN_CORRELATION,
    output:
        expand("figures/{{experiment}}_{{view}}.{kind}", kind=KINDS),
    log:
        "results/logs/experiments/{experiment}/plot_{view}.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/plot_{view}.tsv"
    threads: 1
    params:
        code=code("plot_experiment"),
    script:
        "../scripts/plot_experiment.py"


for name in EXPERIMENTS:

    rule:
        name:
            name
        input:
            tables_of(name).values(),
            figures_of(name),
