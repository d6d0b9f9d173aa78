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

from reacher_shaping.figures import paper, robustness
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.report import captions, paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

folder = Path(results)

# %%
cells = read_table(folder / "cells.parquet", schemas.CELLS)
runs = read_table(folder / "runs.parquet", schemas.RUNS)
theirs = paper_tables.published_cells(
    pd.read_csv(Path(published) / "table2.csv"),
    pd.read_csv(Path(published) / "table3.csv"),
)

# %%
SVG(to_bytes(paper.figure_2(cells, theirs, protocol), "svg"))

# %%
Markdown(captions.caption("figure_2", cells, runs, protocol))

# %% [markdown]
# ## Every run
# The same with a dot per seed: how far single runs of one cell lie apart.

# %%
SVG(to_bytes(robustness.seed_strip(runs, cells, theirs, protocol=protocol), "svg"))
