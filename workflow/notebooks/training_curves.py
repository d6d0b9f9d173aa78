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
# # Training curves (Figures 1 and 4)
#
# How the unshaped episode return develops while training, per variant, budget and start weight.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from pathlib import Path

from IPython.display import SVG, Markdown

from reacher_shaping.figures import paper
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.report import captions
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

folder = Path(results)

# %%
cells = read_table(folder / "cells.parquet", schemas.CELLS)
lines = read_table(folder / "curves.parquet", schemas.CURVES)

# %% [markdown]
# ## Constant and decayed shaping with the plain distance, and L2² with a constant weight

# %%
SVG(to_bytes(paper.figure_1(lines, protocol), "svg"))

# %%
Markdown(captions.caption("figure_1", cells, protocol=protocol))

# %% [markdown]
# ## Decayed shaping with the squared distance

# %%
SVG(to_bytes(paper.figure_4(lines, protocol), "svg"))

# %%
Markdown(captions.caption("figure_4", cells, protocol=protocol))

# %% [markdown]
# ## Where each curve has its highest point

# %%
lines = lines[lines["protocol"] == protocol].dropna(subset="episode_return")
highest = lines.groupby(["variant", "budget", "alpha0"])["episode_return"].idxmax()
lines.loc[highest, ["variant", "budget", "alpha0", "iteration", "episode_return", "low", "high"]].reset_index(drop=True)
