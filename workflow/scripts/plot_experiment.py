"""Draw one view of an experiment."""

from pathlib import Path

import pandas as pd
from job import logged

from reacher_shaping import artifacts
from reacher_shaping import experiment_figures as figures

given, wildcards = snakemake.input, snakemake.wildcards

with logged(snakemake.log[0]):
    draw = {
        "cells": lambda: figures.cells(
            artifacts.read_table(given.runs, artifacts.RUNS),
            artifacts.read_table(given.cells, artifacts.CELLS),
            artifacts.read_table(given.controllers, artifacts.CONTROLLERS),
        ),
        "effects": lambda: figures.effects(artifacts.read_table(given.effects, artifacts.EFFECTS)),
        "log": lambda: figures.log(
            artifacts.read_table(given.logged, artifacts.CURVES), pd.read_csv(given.training_logs)
        ),
        "correlation": lambda: figures.correlation(
            artifacts.read_table(given.correlation, artifacts.CORRELATION),
            artifacts.read_table(given.main[0], artifacts.CORRELATION) if given.main else None,
        ),
        "forest": lambda: figures.forest(artifacts.read_table(given.comparisons, artifacts.COMPARISONS)),
    }
    figures.save(draw[wildcards.view](), Path("figures") / f"{wildcards.experiment}_{wildcards.view}")
