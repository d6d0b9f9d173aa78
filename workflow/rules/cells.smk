# The cells of all studies, and the seed blocks they are trained in.
from reacher_shaping.settings.study import block_name

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


def evaluation_of(cell):
    """How a cell's policies are evaluated: as the study says, at the cell's own success radius."""
    return as_json(STUDY.evaluation.model_dump() | {"radius": STUDY.radius_of(cell)})


def tasks_of(cells):
    """The tasks that a script looks up by name for these cells, as `code` takes them."""
    return tuple(sorted({cell.chosen_code[0] for cell in cells}))


def seeds_of(cell):
    """Runs of a cell, as many as the study that asks for most."""
    counts = {name: experiment.seeds for name, experiment in STUDY.experiments.items()}
    asking = [counts[name] for name, cells in EXPERIMENTS.items() if cell in cells]
    return max([STUDY.seeds] * (cell in STUDY.cells) + asking)


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
