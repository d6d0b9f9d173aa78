# Names that several stages share: the study's cells and blocks, and the files they make.
import json
import os

from reacher_shaping.config import block_name
from reacher_shaping.provenance import code_hash

os.environ["OMP_NUM_THREADS"] = "1"  # one thread a job; Snakemake fills the cores with jobs

CELLS = {cell.folder: cell for cell in STUDY.cells}
SEEDS = {block_name(seeds): seeds for seeds in STUDY.blocks()}
BLOCKS = [f"results/{cell}/{block}" for cell in CELLS for block in SEEDS]
CELL_OF_BLOCK = [cell.key for cell in CELLS.values() for _ in SEEDS]
BLOCK_FILES = expand(
    "{block}/{file}",
    block=BLOCKS,
    file=["policy.pt", "progress.parquet", "monitor", "episodes.parquet", "manifest.json"],
)


wildcard_constraints:
    cell=r"[a-z0-9_]+/[a-z0-9_]+/\d+/alpha[\d.]+",
    block=r"seeds\d+-\d+",


def source(path):
    """A file of the repository, relative to the working directory, so that a moved clone reruns nothing."""
    return os.path.relpath(HERE / path)


def code(script):
    """Hash of the code a script runs: a param, so that an edit of that code and nothing else reruns its jobs."""
    return code_hash(HERE / "workflow/scripts" / f"{script}.py")


def as_json(settings):
    return json.dumps(settings, sort_keys=True)
