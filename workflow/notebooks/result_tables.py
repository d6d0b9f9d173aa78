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
from IPython.display import Markdown

from reacher_shaping.report import captions, paper_tables
from reacher_shaping.report.loader import load

study = load(results, published)
cells = study.tables["cells"]

# %% [markdown]
# ## Table 1

# %%
table = paper_tables.table_1(cells, study.published, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_1", cells, None, protocol)))

# %% [markdown]
# ## Table 2

# %%
table = paper_tables.table_2(cells, study.published, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_2", cells, None, protocol)))

# %% [markdown]
# ## Table 3

# %%
table = paper_tables.table_3(cells, study.published, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_3", cells, None, protocol)))
