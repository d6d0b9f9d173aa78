"""Execute one notebook; a failed one is left beside the log."""

from pathlib import Path

from job import logged

from reacher_shaping.jobs import notebooks

source, log = Path(snakemake.input.source), Path(snakemake.log[0])

with logged(str(log)):
    parameters = {"results": "results", "published": str(Path(snakemake.input.table2).parent)}
    notebooks.execute(source, Path(snakemake.output[0]), parameters, log.with_suffix(".ipynb"))
