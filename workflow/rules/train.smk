# From a cell's settings to trained policies: one job per seed block.
BLOCKS = blocks(STUDY.cells, STUDY.seeds)
BLOCK_FILES = expand(
    "{block}/{file}",
    block=BLOCKS,
    file=["policy.pt", "progress.parquet", "monitor", "training.json", "episodes.parquet", "manifest.json"],
)


wildcard_constraints:
    cell=one_of(CELLS),
    block=one_of(SEEDS),


rule train_block:
    input:
        as_asked("training.json"),
    output:
        policy="results/{cell}/{block}/policy.pt",
        progress="results/{cell}/{block}/progress.parquet",
        monitor=directory("results/{cell}/{block}/monitor"),
        training="results/{cell}/{block}/training.json",
    log:
        "results/logs/{cell}/{block}/train.log",
    benchmark:
        "results/benchmarks/{cell}/{block}/train.tsv"
    retries: 1
    group:
        "block"
    threads: 1
    resources:
        mem_mb=growing(1000),
        runtime=training_minutes,
        checkpoints=STORE or "local",
    params:
        cell=lambda wildcards: as_json(CELLS[wildcards.cell].settings()),
        seeds=lambda wildcards: list(SEEDS[wildcards.block]),
        code=lambda wildcards: code("train_block", CELLS[wildcards.cell].chosen_code),
    script:
        "../scripts/train_block.py"


# Every cell is a target of its name, `snakemake -- paper-l2-500000-alpha0.5`; `make cells` lists the names.
for cell in CELLS.values():

    rule:
        name:
            cell.name
        input:
            expand(
                "{block}/{file}",
                block=blocks([cell], seeds_of(cell)),
                file=["policy.pt", "progress.parquet", "training.json", "episodes.parquet", "manifest.json"],
            ),
