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

from reacher_shaping.report import captions, paper_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

folder = Path(results)

# %%
cells = read_table(folder / "cells.parquet", schemas.CELLS)
theirs = paper_tables.published_cells(
    pd.read_csv(Path(published) / "table2.csv"),
    pd.read_csv(Path(published) / "table3.csv"),
)

# %% [markdown]
# ## Table 1

# %%
table = paper_tables.table_1(cells, theirs, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_1", cells, None, protocol)))

# %% [markdown]
# ## Table 2

# %%
table = paper_tables.table_2(cells, theirs, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_2", cells, None, protocol)))

# %% [markdown]
# ## Table 3

# %%
table = paper_tables.table_3(cells, theirs, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_3", cells, None, protocol)))
