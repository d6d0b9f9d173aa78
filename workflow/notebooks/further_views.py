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
from pathlib import Path

import pandas as pd
from IPython.display import SVG, Markdown

from reacher_shaping import artifacts, captions, further, grids, precision, schemas, style, tables

folder = Path(results)

# %%
cells = artifacts.read_table(folder / "cells.parquet", schemas.CELLS)
runs = artifacts.read_table(folder / "runs.parquet", schemas.RUNS)
comparisons = artifacts.read_table(folder / "comparisons.parquet", schemas.COMPARISONS)
radii = artifacts.read_table(folder / "radii.parquet", schemas.RADII)
lengths = artifacts.read_table(folder / "lengths.parquet", schemas.LENGTHS)
power = artifacts.read_table(folder / "power.parquet", schemas.POWER)
variance = artifacts.read_table(folder / "variance.parquet", schemas.VARIANCE)
lottery = artifacts.read_table(folder / "lottery.csv", schemas.LOTTERY)
winners = artifacts.read_table(folder / "winners.csv", schemas.WINNERS)
spread = artifacts.read_table(folder / "spread.csv", schemas.SPREAD)
theirs = tables.published_cells(
    pd.read_csv(Path(published) / "table2.csv"),
    pd.read_csv(Path(published) / "table3.csv"),
)

# %% [markdown]
# ## Every run

# %%
SVG(style.to_bytes(further.seed_strip(runs, cells, theirs, protocol=protocol), "svg"))

# %%
Markdown(captions.caption("seed_strip", cells, runs, protocol))

# %% [markdown]
# ## Differences to no shaping, paired by seed

# %%
SVG(style.to_bytes(further.forest(comparisons, protocol=protocol), "svg"))

# %%
Markdown(captions.caption("forest", cells, runs, protocol))

# %% [markdown]
# ## Does it hang on the radius?

# %%
SVG(style.to_bytes(further.success_by_radius(radii, protocol), "svg"))

# %%
Markdown(captions.caption("success_by_radius", cells, runs, protocol))

# %% [markdown]
# ## Longer episodes than in training

# %%
SVG(style.to_bytes(further.long_episodes(lengths, protocol, metric="final_distance"), "svg"))

# %%
Markdown(captions.caption("long_episodes", cells, runs, protocol))

# %% [markdown]
# ## Better measures

# %%
Markdown(tables.to_markdown(tables.behaviour(cells, protocol), captions.caption("behaviour", cells, runs, protocol)))

# %%
Markdown(
    tables.to_markdown(tables.learning(cells, runs, protocol), captions.caption("learning", cells, runs, protocol))
)

# %% [markdown]
# ## One seed per cell
# The paper trained each cell once. Drawing one of our runs per cell, again and again, gives studies like it.

# %%
SVG(style.to_bytes(further.lottery(lottery), "svg"))

# %%
Markdown(captions.caption("lottery", cells, runs, protocol))

# %%
Markdown(precision.winners_sentence(winners))

# %%
Markdown(grids.to_markdown(precision.winners_grid(winners)))

# %%
Markdown(grids.to_markdown(precision.spread_grid(spread, theirs)))

# %% [markdown]
# ## How many seeds does it take?

# %%
Markdown(precision.power_sentence(power, protocol))

# %%
Markdown(grids.to_markdown(precision.power_grid(power, protocol)))

# %%
Markdown(precision.variance_sentence(variance, protocol))

# %%
Markdown(grids.to_markdown(precision.variance_grid(variance, protocol)))
