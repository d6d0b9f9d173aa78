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

from reacher_shaping.figures import robustness
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.report import captions, paper_tables, seed_uncertainty, text_tables
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import read_table

folder = Path(results)

# %%
cells = read_table(folder / "cells.parquet", schemas.CELLS)
runs = read_table(folder / "runs.parquet", schemas.RUNS)
comparisons = read_table(folder / "comparisons.parquet", schemas.COMPARISONS)
radii = read_table(folder / "radii.parquet", schemas.RADII)
lengths = read_table(folder / "lengths.parquet", schemas.LENGTHS)
power = read_table(folder / "power.parquet", schemas.POWER)
variance = read_table(folder / "variance.parquet", schemas.VARIANCE)
lottery = read_table(folder / "lottery.csv", schemas.LOTTERY)
winners = read_table(folder / "winners.csv", schemas.WINNERS)
spread = read_table(folder / "spread.csv", schemas.SPREAD)
theirs = paper_tables.published_cells(
    pd.read_csv(Path(published) / "table2.csv"),
    pd.read_csv(Path(published) / "table3.csv"),
)

# %% [markdown]
# ## Every run

# %%
SVG(to_bytes(robustness.seed_strip(runs, cells, theirs, protocol=protocol), "svg"))

# %%
Markdown(captions.caption("seed_strip", cells, runs, protocol))

# %% [markdown]
# ## Differences to no shaping, paired by seed

# %%
SVG(to_bytes(robustness.forest(comparisons, protocol=protocol), "svg"))

# %%
Markdown(captions.caption("forest", cells, runs, protocol))

# %% [markdown]
# ## Does it hang on the radius?

# %%
SVG(to_bytes(robustness.success_by_radius(radii, protocol), "svg"))

# %%
Markdown(captions.caption("success_by_radius", cells, runs, protocol))

# %% [markdown]
# ## Longer episodes than in training

# %%
SVG(to_bytes(robustness.long_episodes(lengths, protocol, metric="final_distance"), "svg"))

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
SVG(to_bytes(robustness.lottery(lottery), "svg"))

# %%
Markdown(captions.caption("lottery", cells, runs, protocol))

# %%
Markdown(seed_uncertainty.winners_sentence(winners))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.winners_grid(winners)))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.spread_grid(spread, theirs)))

# %% [markdown]
# ## How many seeds does it take?

# %%
Markdown(seed_uncertainty.power_sentence(power, protocol))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.power_grid(power, protocol)))

# %%
Markdown(seed_uncertainty.variance_sentence(variance, protocol))

# %%
Markdown(text_tables.to_markdown(seed_uncertainty.variance_grid(variance, protocol)))
