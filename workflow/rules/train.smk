# From a cell's settings to trained policies: one job per seed block.
from reacher_shaping.config import block_name

EXPERIMENTS = STUDY.experiment_cells  # the further studies' cells, see experiments.smk
CELLS = {cell.folder: cell for cells in [STUDY.cells, *EXPERIMENTS.values()] for cell in cells}
SEEDS = {
    block_name(seeds): seeds
    for count in [STUDY.seeds, *(experiment.seeds for experiment in STUDY.experiments.values())]
    for seeds in STUDY.blocks(count)
}


def blocks(cells, seeds):
    """Folders of the seed blocks of cells: cell by cell, so in the order of `block_cells`."""
    return [f"results/{cell.folder}/{block_name(block)}" for cell in cells for block in STUDY.blocks(seeds)]


def block_cells(cells, seeds):
    """The cell's key of each of these blocks."""
    return [cell.key for cell in cells for _ in STUDY.blocks(seeds)]


def protocols_of(cells, seeds=None):
    """The settings of the cells' protocols, each once."""
    return as_json(list({cell.protocol.name: cell.protocol.model_dump() for cell in cells}.values()))


BLOCKS = blocks(STUDY.cells, STUDY.seeds)
BLOCK_FILES = expand(
    "{block}/{file}",
    block=BLOCKS,
    file=["policy.pt", "progress.parquet", "monitor", "episodes.parquet", "manifest.json"],
)


wildcard_constraints:
    cell=r"[a-z0-9_]+/[a-z0-9_]+/\d+/alpha[\d.]+",
    block=r"seeds\d+-\d+",


rule train_block:
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
    threads: 1
    resources:
        mem_mb=1000,
    params:
        cell=lambda wildcards: as_json(CELLS[wildcards.cell].settings()),
        seeds=lambda wildcards: list(SEEDS[wildcards.block]),
        radius=STUDY.evaluation.radius,
        code=code("train_block"),
    script:
        "../scripts/train_block.py"
