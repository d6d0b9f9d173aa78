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

from reacher_shaping import artifacts, experiment_report, experiments, schemas, tables

folder = Path(results)

# %%
paths = [path for path in sorted(folder.glob("experiments/*/*")) if path.suffix in (".parquet", ".csv")]
given = experiments.read(str(path) for path in paths if path.stem in experiments.SCHEMAS)
training_logs = pd.read_csv(Path(published) / "training_logs.csv")
theirs = tables.published_cells(
    *(pd.read_csv(Path(published) / f"{name}.csv") for name in ("table2", "table3", "left_out"))
)
main = artifacts.read_table(folder / "correlation.csv", schemas.CORRELATION)

# %%
nothing = "No further study has been run; `snakemake released attribution standard tuned ablation` does it."
Markdown(experiment_report.document(given, training_logs, main, theirs) or nothing)
