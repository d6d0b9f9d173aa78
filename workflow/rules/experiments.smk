# The further studies of config.yaml, each an optional target of its name: `snakemake attribution`. Once made, they are
# part of the report: MADE are those whose tables are there.
MADE = [name for name in EXPERIMENTS if all(made(path) for path in tables_of(name))]
MADE_TABLES = [path for name in MADE for path in tables_of(name)]
MADE_BLOCKS = [(EXPERIMENTS[name], STUDY.experiments[name].seeds) for name in MADE]
MADE_MANIFESTS = [f"{block}/manifest.json" for cells_and_seeds in MADE_BLOCKS for block in blocks(*cells_and_seeds)]
MADE_ASKED = [block for cells_and_seeds in MADE_BLOCKS for block in asked_of_blocks(*cells_and_seeds)]
MADE_FIGURES = [path for name in MADE for path in figures_of(name)]


wildcard_constraints:
    experiment=one_of(EXPERIMENTS),
    view=one_of(VIEWS),


use rule aggregate_runs as aggregate_experiment with:
    input:
        progress=of_blocks("progress.parquet"),
        manifests=ancient(of_blocks("manifest.json")),
        episodes=of_blocks("episodes.parquet"),
    output:
        **tables_made("aggregate_experiment", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/aggregate.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/aggregate.tsv"
    params:
        cells=lambda wildcards: block_cells(wildcards.experiment),
        asked=of_experiment(asked_of_blocks),
        code=code("aggregate_runs"),


use rule evaluate_controllers as evaluate_experiment_controllers with:
    output:
        **tables_made("evaluate_experiment_controllers", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/controllers.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/controllers.tsv"
    params:
        evaluation=as_json(STUDY.evaluation.model_dump()),
        protocols=of_experiment(protocols_of),
        root_seed=of_experiment(lambda cells, seeds: cells[0].root_seed),
        code=of_experiment(lambda cells, seeds: code("evaluate_controllers", tasks_of(cells))),


use rule train_peer as train_experiment_peer with:
    output:
        run="results/experiments/{experiment}/peers/{algorithm}/seed{seed}.parquet",
        manifest="results/experiments/{experiment}/peers/{algorithm}/seed{seed}.json",
    log:
        "results/logs/experiments/{experiment}/{algorithm}-{seed}.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/{algorithm}-{seed}.tsv"
    wildcard_constraints:
        experiment=one_of(name for name in EXPERIMENTS if peers_of(name)),
    params:
        budget=lambda wildcards: STUDY.experiments[wildcards.experiment].peers.budgets[wildcards.algorithm],
        protocol=of_experiment(lambda cells, seeds: as_json(cells[0].protocol.model_dump())),
        evaluation=as_json(STUDY.evaluation.model_dump()),
        root_seed=STUDY.root_seed,
        code=of_experiment(lambda cells, seeds: code("train_peer", tasks_of(cells))),


use rule check_results as check_experiment with:
    input:
        runs="results/experiments/{experiment}/runs.parquet",
        cells="results/experiments/{experiment}/cells.parquet",
    output:
        "results/experiments/{experiment}/check.txt",
    log:
        "results/logs/experiments/{experiment}/check.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/check.tsv"
    params:
        cells=of_experiment(lambda cells, seeds: [cell.key for cell in cells]),
        seeds=of_experiment(lambda cells, seeds: seeds),
        episodes=STUDY.evaluation.episodes,
        protocols=of_experiment(protocols_of),
        code=of_experiment(lambda cells, seeds: code("check_results", tasks_of(cells))),


rule summarise_experiment:
    input:
        **PUBLISHED,
        runs="results/experiments/{experiment}/runs.parquet",
        progress=of_blocks("progress.parquet"),
        manifests=ancient(of_blocks("manifest.json")),
    output:
        **tables_made("summarise_experiment", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/summarise.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/summarise.tsv"
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        cells=lambda wildcards: block_cells(wildcards.experiment),
        asked=of_experiment(asked_of_blocks),
        code=code("summarise_experiment"),
    script:
        "../scripts/summarise_experiment.py"


use rule judge_claims as judge_experiment with:
    input:
        **PUBLISHED,
        runs="results/experiments/{experiment}/runs.parquet",
        controllers="results/experiments/{experiment}/controllers.parquet",
        ledger=source("report/claims.yaml"),
    output:
        **tables_made("judge_experiment", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/judge_claims.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/judge_claims.tsv"
    wildcard_constraints:
        experiment=one_of(name for name, cells in EXPERIMENTS.items() if judged(cell.key for cell in cells)),
    params:
        protocols=of_experiment(lambda cells, seeds: list(dict.fromkeys(cell.protocol.name for cell in cells))),
        twins=of_experiment(lambda cells, seeds: twins(cells)),
        code=code("judge_claims"),


rule measure_effects:
    input:
        runs="results/experiments/{experiment}/runs.parquet",
    output:
        **tables_made("measure_effects", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/effects.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/effects.tsv"
    wildcard_constraints:
        experiment=one_of(name for name, study in STUDY.experiments.items() if study.switches),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        switches=lambda wildcards: as_json(STUDY.experiments[wildcards.experiment].switches.model_dump()),
        protocols=of_experiment(protocols_of),
        code=code("measure_effects"),
    script:
        "../scripts/measure_effects.py"


rule summarise_lengths:
    input:
        long_episodes=of_blocks("long_episodes.parquet"),
        manifests=ancient(of_blocks("long_episodes.json")),
    output:
        **tables_made("summarise_lengths", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/lengths.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/lengths.tsv"
    wildcard_constraints:
        experiment=one_of(name for name, study in STUDY.experiments.items() if study.lengths),
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        cells=lambda wildcards: block_cells(wildcards.experiment),
        asked=of_experiment(asked_of_blocks),
        code=code("summarise_lengths"),
    script:
        "../scripts/summarise_lengths.py"


rule judge_hypotheses:
    input:
        runs="results/experiments/{experiment}/runs.parquet",
        progress=of_blocks("progress.parquet"),
    output:
        **tables_made("judge_hypotheses", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/hypotheses.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/hypotheses.tsv"
    wildcard_constraints:
        experiment=one_of(HYPOTHESES),
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        ledger=lambda wildcards: as_json(HYPOTHESES[wildcards.experiment] | {"dated": None}),
        cells=lambda wildcards: block_cells(wildcards.experiment),
        code=code("judge_hypotheses"),
    script:
        "../scripts/judge_hypotheses.py"


rule map_targets:
    input:
        episodes=of_blocks("episodes.parquet"),
        manifests=ancient(of_blocks("manifest.json")),
    output:
        **tables_made("map_targets", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/map_targets.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/map_targets.tsv"
    wildcard_constraints:
        experiment=one_of(name for name in EXPERIMENTS if "targets" in tables_named(name)),
    threads: 1
    resources:
        mem_mb=growing(2000),
        runtime=growing(30),
    params:
        cells=lambda wildcards: block_cells(wildcards.experiment),
        asked=of_experiment(asked_of_blocks),
        root_seed=of_experiment(lambda cells, seeds: cells[0].root_seed),
        code=code("map_targets"),
    script:
        "../scripts/map_targets.py"


rule compare_with_peers:
    input:
        runs="results/experiments/{experiment}/runs.parquet",
        peers=lambda wildcards: peers_of(wildcards.experiment),
    output:
        **tables_made("compare_with_peers", "{experiment}"),
    log:
        "results/logs/experiments/{experiment}/agreement.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/agreement.tsv"
    wildcard_constraints:
        experiment=one_of(name for name in EXPERIMENTS if peers_of(name)),
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        protocol=of_experiment(lambda cells, seeds: cells[0].protocol.name),
        asked=lambda wildcards: asked_of_peers(
            STUDY.experiments[wildcards.experiment].peers, EXPERIMENTS[wildcards.experiment][0].protocol
        ),
        code=code("compare_with_peers"),
    script:
        "../scripts/compare_with_peers.py"


rule plot_experiment:
    input:
        lambda wildcards: tables_of(wildcards.experiment),
        training_logs=source("report/published/training_logs.csv"),
    output:
        report("figures/{experiment}_{view}.svg", category="Further studies", subcategory="{experiment}"),
        expand("figures/{{experiment}}_{{view}}.{kind}", kind=[kind for kind in KINDS if kind != "svg"]),
    log:
        "results/logs/experiments/{experiment}/plot_{view}.log",
    benchmark:
        "results/benchmarks/experiments/{experiment}/plot_{view}.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        code=code("plot_experiment"),
    script:
        "../scripts/plot_experiment.py"
