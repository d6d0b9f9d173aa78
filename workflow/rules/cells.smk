# The cells of all studies, and the seed blocks they are trained in.
from snakemake.io import IOFile

from reacher_shaping.settings.study import MAIN, block_name

CELLS = {cell.folder: cell for cells in STUDY.cells_of.values() for cell in cells}
SEEDS = {block_name(seeds): seeds for study in STUDY.studies.values() for seeds in STUDY.blocks(study.seeds)}


def blocks(cells, seeds):
    """Folders of the seed blocks of cells: cell by cell, so in the order of `block_cells`."""
    return [f"results/{cell.folder}/{block_name(block)}" for cell in cells for block in STUDY.blocks(seeds)]


def block_cells(study):
    """Of each of the blocks of a study, in their order, the columns of its cell."""
    return [cell for cell in STUDY.design(study) for _ in STUDY.blocks(STUDY.studies[study].seeds)]


def asked(cell, seeds):
    """What the manifest of a block must tell, or the block is another's."""
    evaluation = {"settings": json.loads(evaluation_of(cell))}
    return {"settings": {"cell": cell.settings()}, "seeds": list(seeds), "evaluation": evaluation}


def asked_of_blocks(cells, seeds):
    """The same of many blocks, in the order of `blocks`."""
    return [as_json(asked(cell, block)) for cell in cells for block in STUDY.blocks(seeds)]


def asked_of_block(wildcards):
    """The same of the block that wildcards name."""
    return as_json(asked(CELLS[wildcards.cell], SEEDS[wildcards.block]))


def as_asked(manifest):
    """No input, but an end with one line where Snakemake would keep a block made with other settings.

    It knows what a file was made with by its own records. A study that was copied without them looks up to date.
    """

    def check(wildcards):
        path = Path(f"results/{wildcards.cell}/{wildcards.block}/{manifest}")
        if path.exists() and not workflow.persistence.metadata(IOFile(str(path))):
            from reacher_shaping.storage import files, provenance  # rarely needed, and slow to load

            try:
                provenance.require_asked(path, asked(CELLS[wildcards.cell], SEEDS[wildcards.block]))
            except files.ArtifactError as error:
                sys.exit(f"ArtifactError: {error}")
        return []

    return check


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
    return max(study.seeds for name, study in STUDY.studies.items() if cell in STUDY.cells_of[name])


def first_block(cell, file):
    """A file of the first block of a cell."""
    return f"results/{cell.folder}/{next(iter(SEEDS))}/{file}"
