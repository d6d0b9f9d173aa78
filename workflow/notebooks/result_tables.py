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
# # Tables 1 to 3
#
# The values behind the figures, with the published ones beside them.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from pathlib import Path

import pandas as pd
from IPython.display import Markdown

from reacher_shaping import artifacts, captions, schemas, tables

folder = Path(results)

# %%
cells = artifacts.read_table(folder / "cells.parquet", schemas.CELLS)
theirs = tables.published_cells(
    pd.read_csv(Path(published) / "table2.csv"),
    pd.read_csv(Path(published) / "table3.csv"),
)

# %% [markdown]
# ## Table 1

# %%
table = tables.table_1(cells, theirs, protocol)
Markdown(tables.to_markdown(table, captions.caption("table_1", cells, None, protocol)))

# %% [markdown]
# ## Table 2

# %%
table = tables.table_2(cells, theirs, protocol)
Markdown(tables.to_markdown(table, captions.caption("table_2", cells, None, protocol)))

# %% [markdown]
# ## Table 3

# %%
table = tables.table_3(cells, theirs, protocol)
Markdown(tables.to_markdown(table, captions.caption("table_3", cells, None, protocol)))
