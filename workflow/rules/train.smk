# From a cell's settings to trained policies: one job per seed block.


rule train_block:
    output:
        policy="results/{cell}/{block}/policy.pt",
        progress="results/{cell}/{block}/progress.parquet",
        monitor=directory("results/{cell}/{block}/monitor"),
        training="results/{cell}/{block}/training.json",
    params:
        cell=lambda wildcards: as_json(CELLS[wildcards.cell].settings()),
        seeds=lambda wildcards: list(SEEDS[wildcards.block]),
        radius=STUDY.evaluation.radius,
        code=code("train_block"),
    log:
        "results/logs/{cell}/{block}/train.log",
    benchmark:
        "results/benchmarks/{cell}/{block}/train.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    retries: 1
    script:
        "../scripts/train_block.py"
