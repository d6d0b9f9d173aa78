"""A figure is one function, its name in the rule that draws it, and its title and caption."""

import re
from pathlib import Path

import pandas as pd
import pytest
import synthetic

from reacher_shaping.figures import drawing
from reacher_shaping.report import captions
from reacher_shaping.settings import outputs

RULES = Path(__file__).parents[2] / "workflow" / "rules" / "figures.smk"
NAMES = [
    name
    for line in RULES.read_text(encoding="utf-8").splitlines()
    if line.startswith("FIGURE_NAMES ")
    for name in re.findall(r'"(\w+)"', line)
]


def test_the_rule_names_the_papers_figures_and_more():
    assert NAMES[:4] == ["figure_1", "figure_2", "figure_3", "figure_4"]
    assert len(NAMES) > 4


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_of_the_rule_has_a_function_a_title_and_a_caption(name):
    assert any(hasattr(module, name) for module in drawing.MAIN)
    cells, runs = synthetic.cells(synthetic.TOY_GRID, 2), synthetic.runs(synthetic.TOY_GRID, 2)
    assert captions.title(name)
    assert captions.caption(name, cells, runs)


@pytest.mark.parametrize("view", outputs.VIEWS)
def test_a_figure_of_a_further_study_has_a_function_a_title_and_a_caption(view):
    assert any(hasattr(module, view) for module in drawing.STUDY)
    assert captions.title(f"mine_{view}")
    assert captions.caption(f"mine_{view}", synthetic.cells(synthetic.TOY_GRID, 2))


def test_a_figure_is_drawn_from_the_tables_that_its_parameters_name():
    lottery = pd.DataFrame({"statement": ["one"], "share": [0.5]})
    figure = drawing.draw("lottery", {"lottery": lottery, "cells": None})
    assert [bar.get_width() for bar in figure.axes[0].patches] == [0.5]


def test_unknown_figures_and_missing_tables_are_named():
    with pytest.raises(KeyError, match="no figure is called sunset"):
        drawing.draw("sunset", {})
    with pytest.raises(KeyError, match="the figure seed_strip is drawn from cells, which is not there"):
        drawing.draw("seed_strip", {"runs": None})


def test_a_figure_without_a_caption_is_an_error():
    with pytest.raises(KeyError, match="sunset"):
        captions.caption("sunset", synthetic.cells(synthetic.TOY_GRID, 2))
