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
from IPython.display import SVG, Markdown

from reacher_shaping.figures import paper
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.labels import CELL
from reacher_shaping.report import captions
from reacher_shaping.report.loader import load

study = load(results, published)
cells, curves = study.tables["cells"], study.tables["curves"]

# %% [markdown]
# ## Constant and decayed shaping with the plain distance, and L2² with a constant weight

# %%
SVG(to_bytes(paper.figure_1(curves, protocol), "svg"))

# %%
Markdown(captions.caption("figure_1", cells, protocol=protocol))

# %% [markdown]
# ## Decayed shaping with the squared distance

# %%
SVG(to_bytes(paper.figure_4(curves, protocol), "svg"))

# %%
Markdown(captions.caption("figure_4", cells, protocol=protocol))

# %% [markdown]
# ## Where each curve has its highest point

# %%
curves = curves[curves["protocol"] == protocol].dropna(subset="episode_return")
highest = curves.groupby(CELL)["episode_return"].idxmax()
curves.loc[highest, [*CELL, "iteration", "episode_return", "low", "high"]].round(2).reset_index(drop=True)
