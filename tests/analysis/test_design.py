"""What a cell is for is declared: a variant that the paper does not have changes nothing that is the paper's."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import synthetic
import yaml
from synthetic import DESIGN, PAPER_GRID

from reacher_shaping.analysis import claim_formulas, claims, comparisons, correlation
from reacher_shaping.analysis.learning_curves import curve_table
from reacher_shaping.figures import paper
from reacher_shaping.labels import KEY
from reacher_shaping.report import paper_tables, summary
from reacher_shaping.report.loader import Study

LEDGER = yaml.safe_load((Path(__file__).parents[2] / "report/claims.yaml").read_text(encoding="utf-8"))
EXTRA = {"exp": ("constant", np.nan), "decay300k_exp": ("linear", 300_000.0), "l2": ("constant", np.nan)}
MEASURES = ["success_rate", "mean_return", "final_success_rate", "final_distance"]


def runs(grid):
    """Runs that do not depend on which others there are."""
    parts = []
    for number, cell in enumerate(grid):
        own = synthetic.runs([cell], 6) if cell[1] in synthetic.MAIN + synthetic.L2SQ else extra(cell)
        random = np.random.default_rng(number)
        parts.append(own.assign(success_rate=random.uniform(0.1, 0.5, 6), mean_return=random.normal(-12, 1, 6)))
    return pd.concat(parts, ignore_index=True)


def extra(cell, potential="exp"):
    """Runs of a cell that the paper does not have."""
    schedule, horizon = EXTRA[cell[1]]
    design = ("main", "extra", potential, schedule, horizon)
    own = synthetic.runs([("paper", "l2", *cell[2:])], 6).assign(variant=cell[1], mean_return=-1.0)
    return own.assign(**dict(zip(DESIGN, design, strict=True)))


PAPER = runs(PAPER_GRID)
MORE = pd.concat(
    [
        PAPER,
        runs([("paper", name, budget, 1.0) for name in ("exp", "decay300k_exp") for budget in (500_000, 1_000_000)]),
        extra(("paper", "l2", 2_000_000, 1.0), potential="l2"),  # a variant of the paper where the paper has no cell
    ],
    ignore_index=True,
)
PUBLISHED, NO_LOGS = synthetic.published(), pd.DataFrame()


def cells(table):
    return synthetic.summary(table)


@pytest.mark.parametrize("make", [paper_tables.table_1, paper_tables.table_2, paper_tables.table_3])
def test_tables_of_the_paper_do_not_change(make):
    pd.testing.assert_frame_equal(make(cells(MORE), PUBLISHED), make(cells(PAPER), PUBLISHED))
    assert len(make(cells(PAPER), PUBLISHED)) in (6, 17)


def test_correlations_do_not_change():
    ours = correlation.by_protocol(MORE)
    pd.testing.assert_frame_equal(ours, correlation.by_protocol(PAPER))
    assert set(ours.loc[ours["level"] == "cells", "n"]) == {17}


def test_comparisons_of_the_papers_cells_do_not_change():
    keys = ["family", "metric", *KEY]
    ours, more = (comparisons.comparison_frame(table).set_index(keys) for table in (PAPER, MORE))
    pd.testing.assert_frame_equal(more.loc[ours.index], ours)


def test_partners_come_from_the_design():
    more = comparisons.comparison_frame(MORE)
    decayed = more[(more["variant"] == "decay300k_exp") & (more["family"] == "constant")]
    assert set(decayed["other_variant"]) == {"exp"}
    assert set(more.loc[(more["variant"] == "exp") & (more["family"] == "none"), "other_variant"]) == {"none"}


def test_first_screen_does_not_change():
    def first(table):
        tables = {"cells": cells(table), "comparisons": comparisons.comparison_frame(table)}
        tables["controllers"] = synthetic.controllers()
        return summary.summary(Study(tables, {}, PUBLISHED, PUBLISHED, NO_LOGS))

    assert repr(first(MORE)) == repr(first(PAPER))  # as texts: a bar without an interval has NaN for it
    assert first(PAPER).answers
    assert first(PAPER).bars


def test_claims_do_not_change():
    def ledger(table):
        own = table[correlation.in_paper(table)]
        return claims.claims_frame(LEDGER, claims.judged(LEDGER, claim_formulas.Study(own, untrained=0.1), PUBLISHED))

    pd.testing.assert_frame_equal(ledger(MORE), ledger(PAPER))
    assert not (ledger(PAPER).set_index("id").drop(["C4", "C14", "C19"])["verdict"] == "untestable").any()


def test_figures_of_the_paper_draw_the_papers_cells():
    progress = synthetic.progress(PAPER_GRID, 2)
    other = progress[progress["variant"] == "l2"].assign(variant="exp", group="extra", potential="exp")

    def drawn(figure):
        return [(axes.get_title(), len(axes.get_lines())) for axes in figure.axes]

    ours, more = (curve_table(pd.concat(parts, ignore_index=True)) for parts in ([progress], [progress, other]))
    for figure in (paper.figure_1, paper.figure_4):
        assert drawn(figure(more)) == drawn(figure(ours))
