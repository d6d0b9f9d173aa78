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
# # Does reward shaping help PPO reach?
#
# The study from its question to its answers. Every number below is read from the tables of this study.
#
# A two-joint arm learns to bring its fingertip to a random target (Reacher-v5). Potential-based shaping adds
# `alpha(t) (gamma Phi(s') - Phi(s))` to the reward, where Phi is minus the distance to the target (L2) or minus its
# square (L2²), and alpha(t) is constant or falls linearly to zero. The paper trained one agent per setting and found
# that shaping helps, decayed shaping most. Here every setting is trained from several seeds, and the question is which
# of the findings stand.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from IPython.display import SVG, Markdown

from reacher_shaping.figures import paper
from reacher_shaping.figures.style import to_bytes
from reacher_shaping.report import captions, claims_view, paper_tables
from reacher_shaping.report.loader import load
from reacher_shaping.report.summary import summary, to_markdown
from reacher_shaping.report.text import say
from reacher_shaping.report.text_tables import study_grid
from reacher_shaping.report.text_tables import to_markdown as to_table

study = load(results, published)
cells, runs, curves = (study.tables[name] for name in ("cells", "runs", "curves"))

# %% [markdown]
# ## In short

# %%
Markdown(to_markdown(summary(study, protocol)))

# %% [markdown]
# ## What was run

# %%
ours = cells[cells["protocol"] == protocol]
Markdown(to_table(study_grid(ours)))

# %% [markdown]
# ## How training goes
# The environment's own return, without the shaping terms, iteration by iteration.

# %%
SVG(to_bytes(paper.figure_1(curves, protocol), "svg"))

# %%
Markdown(captions.caption("figure_1", cells, runs, protocol))

# %% [markdown]
# ## Who reaches the target
# Evaluation counts an episode as a success if the fingertip comes close enough at any step, even in passing. A policy
# that merely flails earns some successes too, so the tables also give success at the last step.

# %%
SVG(to_bytes(paper.figure_2(cells, study.published, protocol), "svg"))

# %%
Markdown(captions.caption("figure_2", cells, runs, protocol))

# %%
table = paper_tables.table_1(cells, study.published, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_1", cells, runs, protocol)))

# %% [markdown]
# ## Does a better return mean more success?

# %%
SVG(to_bytes(paper.figure_3(study.tables["correlation"], study.tables["correlation_published"], protocol), "svg"))

# %% [markdown]
# ## The experiment of the appendix
# Decayed shaping with the squared distance.

# %%
SVG(to_bytes(paper.figure_4(curves, protocol), "svg"))

# %%
table = paper_tables.table_3(cells, study.published, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_3", cells, runs, protocol)))

# %% [markdown]
# ## All cells

# %%
table = paper_tables.table_2(cells, study.published, protocol)
Markdown(paper_tables.to_markdown(table, captions.caption("table_2", cells, runs, protocol)))

# %% [markdown]
# ## Which claims stand

# %%
judged = claims_view.claims(study.ledger, study.tables)
Markdown(claims_view.to_markdown(judged) if judged else say("page.claims_none"))
