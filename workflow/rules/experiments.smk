# The further studies of config.yaml, each an optional target of its name: `snakemake attribution`.
def of_experiment(make):
    """A param or input made of the cells and seeds of the experiment named by the wildcard."""
    return lambda wildcards: make(EXPERIMENTS[wildcards.experiment], STUDY.experiments[wildcards.experiment].seeds)


def of_blocks(file):
    return of_experiment(lambda cells, seeds: [f"{block}/{file}" for block in blocks(cells, seeds)])


wildcard_constraints:
    experiment="|".join(EXPERIMENTS) or "none",


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


for name in EXPERIMENTS:

    rule:
        name:
            name
        input:
            expand("results/experiments/{experiment}/{file}.parquet", experiment=name, file=["runs", "cells", "curves"]),
