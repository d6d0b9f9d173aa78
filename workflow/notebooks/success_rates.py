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
# # Success rates (Figure 2)
#
# How often the evaluated policies come within the success radius of the target, at any step of an episode.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from pathlib import Path

import pandas as pd
from IPython.display import SVG, Markdown

from reacher_shaping import artifacts, captions, further, plots, schemas, style, tables

folder = Path(results)

# %%
cells = artifacts.read_table(folder / "cells.parquet", schemas.CELLS)
runs = artifacts.read_table(folder / "runs.parquet", schemas.RUNS)
theirs = tables.published_cells(
    pd.read_csv(Path(published) / "table2.csv"),
    pd.read_csv(Path(published) / "table3.csv"),
)

# %%
SVG(style.to_bytes(plots.figure_2(cells, theirs, protocol), "svg"))

# %%
Markdown(captions.caption("figure_2", cells, runs, protocol))

# %% [markdown]
# ## Every run
# The same with a dot per seed: how far single runs of one cell lie apart.

# %%
SVG(style.to_bytes(further.seed_strip(runs, cells, theirs, protocol=protocol), "svg"))
