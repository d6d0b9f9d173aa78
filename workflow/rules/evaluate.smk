# From trained policies to a row per evaluation episode.


rule evaluate_block:
    input:
        policy="results/{cell}/{block}/policy.pt",
        training=ancient("results/{cell}/{block}/training.json"),
        made=as_asked("manifest.json"),
    output:
        episodes="results/{cell}/{block}/episodes.parquet",
        manifest="results/{cell}/{block}/manifest.json",
    log:
        "results/logs/{cell}/{block}/evaluate.log",
    benchmark:
        "results/benchmarks/{cell}/{block}/evaluate.tsv"
    group:
        "block"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=evaluation_minutes,
    params:
        asked=asked_of_block,
        evaluation=lambda wildcards: evaluation_of(CELLS[wildcards.cell]),
        environment=lambda wildcards: as_json(CELLS[wildcards.cell].protocol.environment.model_dump()),
        root_seed=lambda wildcards: CELLS[wildcards.cell].root_seed,
        code=lambda wildcards: code("evaluate_block", CELLS[wildcards.cell].chosen_code[:1]),
    script:
        "../scripts/evaluate_block.py"


rule evaluate_long:
    input:
        policy="results/{cell}/{block}/policy.pt",
        training=ancient("results/{cell}/{block}/training.json"),
        made=as_asked("long_episodes.json"),
    output:
        episodes="results/{cell}/{block}/long_episodes.parquet",
        manifest="results/{cell}/{block}/long_episodes.json",
    log:
        "results/logs/{cell}/{block}/evaluate_long.log",
    benchmark:
        "results/benchmarks/{cell}/{block}/evaluate_long.tsv"
    group:
        "block"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=evaluation_minutes,
    params:
        asked=asked_of_block,
        evaluation=lambda wildcards: evaluation_of(CELLS[wildcards.cell]),
        environment=lambda wildcards: as_json(CELLS[wildcards.cell].protocol.environment.model_dump()),
        root_seed=lambda wildcards: CELLS[wildcards.cell].root_seed,
        code=lambda wildcards: code("evaluate_long", CELLS[wildcards.cell].chosen_code[:1]),
    script:
        "../scripts/evaluate_long.py"


rule evaluate_controllers:
    output:
        **tables_made("evaluate_controllers"),
    log:
        "results/logs/{folder}evaluate_controllers.log",
    benchmark:
        "results/benchmarks/{folder}evaluate_controllers.tsv"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=growing(30),
    params:
        evaluation=as_json(STUDY.evaluation.model_dump()),
        protocols=of_study(protocols_of),
        root_seed=of_study(lambda cells, seeds: cells[0].root_seed),
        code=of_study(lambda cells, seeds: code("evaluate_controllers", tasks_of(cells))),
    script:
        "../scripts/evaluate_controllers.py"
