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
# # Protocols
#
# Why the published numbers look as they do, and what other settings give: the further studies that have been run.

# %% tags=["parameters"]
results = "results"
published = "report/published"
protocol = "paper"

# %%
from IPython.display import Markdown

from reacher_shaping.report import study_sections
from reacher_shaping.report.loader import load
from reacher_shaping.report.text import say

study = load(results, published)

# %%
nothing = say("page.no_protocols")
Markdown(
    study_sections.document(study.experiments, study.training_logs, study.tables["correlation"], study.every_published)
    or nothing
)
