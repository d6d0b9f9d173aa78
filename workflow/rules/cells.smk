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
