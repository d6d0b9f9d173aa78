"""Execute one notebook; a failed one is left beside the log."""

import tempfile
from itertools import product
from pathlib import Path

from job import logged

from reacher_shaping.jobs import notebooks

given, log = snakemake.input, Path(snakemake.log[0])
folders = {"results": Path(given.claims).parent, "report": Path(given.ledger).parent}

with logged(snakemake), tempfile.TemporaryDirectory() as folder:
    # A folder of the declared inputs alone, under the same names wherever they lie.
    for name, path in product(folders, {*map(Path, given)}):
        if path.is_relative_to(folders[name]):
            link = Path(folder, name, path.relative_to(folders[name]))
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(path.resolve())
    parameters = {"results": "results", "published": "report/published"}
    notebooks.execute(
        Path(given.source), Path(snakemake.output[0]), parameters, log.with_suffix(".ipynb"), Path(folder)
    )
