"""Execute one notebook; a failed one is left beside the log."""

from pathlib import Path

from job import logged

from reacher_shaping import notebooks

with logged(str(Path(snakemake.log[0]).with_suffix(".log"))):
    parameters = {
        "results": str(Path("results").resolve()),
        "published": str(Path(snakemake.params.published).resolve()),
    }
    notebooks.execute(Path(snakemake.input.source), Path(snakemake.output[0]), parameters, Path(snakemake.log[0]))
