# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Protocols
#
# Why the published numbers look as they do, and what other settings give: the further studies that have been run.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from pathlib import Path

import pandas as pd
from IPython.display import Markdown

from reacher_shaping.report import paper_tables, study_sections
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_studies, read_table

folder = Path(results)

# %%
paths = [path for path in sorted(folder.glob("experiments/*/*")) if path.suffix in (".parquet", ".csv")]
given = read_studies(str(path) for path in paths if path.stem in schemas.STUDY_TABLES)
training_logs = pd.read_csv(Path(published) / "training_logs.csv")
theirs = paper_tables.published_cells(
    *(pd.read_csv(Path(published) / f"{name}.csv") for name in ("table2", "table3", "left_out"))
)
main = read_table(folder / "correlation.csv", schemas.CORRELATION)

# %%
nothing = "No further study has been run; `snakemake released attribution standard tuned ablation` does it."
Markdown(study_sections.document(given, training_logs, main, theirs) or nothing)
