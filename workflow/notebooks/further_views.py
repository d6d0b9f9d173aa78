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
# # Further views
#
# What the paper does not show: single runs, paired differences, other radii and episode lengths, better measures, and
# how much a few seeds can tell.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from IPython.display import SVG, Markdown

from reacher_shaping.figures import robustness
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.report import captions, paper_tables, seed_uncertainty, text_tables
from reacher_shaping.report.loader import load

study = load(results, published)
cells, runs = study.tables["cells"], study.tables["runs"]

# %% [markdown]
# ## Every run

# %%
SVG(to_bytes(robustness.seed_strip(runs, cells, study.published, protocol=protocol), "svg"))

# %%
Markdown(captions.caption("seed_strip", cells, runs, protocol))

# %% [markdown]
# ## Differences to no shaping, paired by seed

# %%
SVG(to_bytes(robustness.forest(study.tables["comparisons"], protocol=protocol), "svg"))

# %%
Markdown(captions.caption("forest", cells, runs, protocol))

# %% [markdown]
# ## Does it hang on the radius?

# %%
SVG(to_bytes(robustness.success_by_radius(study.tables["radii"], protocol), "svg"))

# %%
Markdown(captions.caption("success_by_radius", cells, runs, protocol))

# %% [markdown]
# ## Longer episodes than in training

# %%
SVG(to_bytes(robustness.long_episodes(study.tables["lengths"], protocol, metric="final_distance"), "svg"))

# %%
Markdown(captions.caption("long_episodes", cells, runs, protocol))

# %% [markdown]
# ## Better measures

# %%
Markdown(
    paper_tables.to_markdown(
        paper_tables.behaviour(cells, protocol), captions.caption("behaviour", cells, runs, protocol)
    )
)

# %%
Markdown(
    paper_tables.to_markdown(
        paper_tables.learning(cells, runs, protocol), captions.caption("learning", cells, runs, protocol)
    )
)

# %% [markdown]
# ## One seed per cell
# The paper trained each cell once. Drawing one of our runs per cell, again and again, gives studies like it.

# %%
SVG(to_bytes(robustness.lottery(study.tables["lottery"]), "svg"))

# %%
Markdown(captions.caption("lottery", cells, runs, protocol))

# %%
Markdown(seed_uncertainty.winners_sentence(study.tables["winners"]))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.winners_grid(study.tables["winners"])))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.spread_grid(study.tables["spread"], study.published)))

# %% [markdown]
# ## How many seeds does it take?

# %%
Markdown(seed_uncertainty.power_sentence(study.tables["power"], protocol))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.power_grid(study.tables["power"], protocol)))

# %%
Markdown(seed_uncertainty.variance_sentence(study.tables["variance"], protocol))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.variance_grid(study.tables["variance"], protocol)))
