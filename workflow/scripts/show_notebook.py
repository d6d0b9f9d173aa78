"""Make a page of an executed notebook."""

from pathlib import Path

from job import logged

from reacher_shaping.jobs import notebooks
from reacher_shaping.storage.files import write_text

with logged(snakemake):
    write_text(snakemake.output[0], notebooks.page(Path(snakemake.input[0])))
