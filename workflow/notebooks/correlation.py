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
# # Correlations (Figure 3)
#
# How start weight, success rate, mean return and budget go together over the cells of the main grid.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from IPython.display import SVG, Markdown

from reacher_shaping.figures import paper
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.report import captions
from reacher_shaping.report.loader import load

study = load(results, published)
cells, ours, theirs = (study.tables[name] for name in ("cells", "correlation", "correlation_published"))

# %% [markdown]
# Beside ours: the same code applied to the published Table 2.

# %%
SVG(to_bytes(paper.figure_3(ours, theirs, protocol), "svg"))

# %%
Markdown(captions.caption("figure_3", cells, protocol=protocol))

# %% [markdown]
# ## All coefficients

# %%
upper = ours[(ours["protocol"] == protocol) & (ours["x"] < ours["y"])]
upper.pivot(index=["x", "y"], columns=["method", "level"], values="r").round(3)
