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
from IPython.display import SVG, Markdown

from reacher_shaping.figures import paper, robustness
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.report import captions
from reacher_shaping.report.loader import load

study = load(results, published)
cells, runs = study.tables["cells"], study.tables["runs"]

# %%
SVG(to_bytes(paper.figure_2(cells, study.published, protocol), "svg"))

# %%
Markdown(captions.caption("figure_2", cells, runs, protocol))

# %% [markdown]
# ## Every run
# The same with a dot per seed: how far single runs of one cell lie apart.

# %%
SVG(to_bytes(robustness.seed_strip(runs, cells, study.published, protocol=protocol), "svg"))
