"""A figure is one function, its name among those of its study, and its title and caption."""

import pandas as pd
import pytest
import synthetic

from reacher_shaping.figures import drawing
from reacher_shaping.report import captions, study_sections
from reacher_shaping.settings import outputs


def test_the_main_study_has_the_papers_figures_and_more():
    assert outputs.MAIN_VIEWS[:4] == ("figure_1", "figure_2", "figure_3", "figure_4")
    assert len(outputs.MAIN_VIEWS) > 4


@pytest.mark.parametrize("name", outputs.MAIN_VIEWS)
def test_a_figure_of_the_main_study_has_a_function_a_title_and_a_caption(name):
    assert any(hasattr(module, name) for module in drawing.MAIN)
    cells, runs = synthetic.cells(synthetic.TOY_GRID, 2), synthetic.runs(synthetic.TOY_GRID, 2)
    assert captions.title(name)
    assert captions.caption(name, cells, runs)


@pytest.mark.parametrize("view", outputs.VIEWS)
def test_a_figure_of_a_further_study_has_a_function_a_title_and_a_caption(view):
    assert any(hasattr(module, view) for module in drawing.STUDY)
    assert captions.title(view, "mine")
    logs = pd.DataFrame({"protocol": ["p"], "budget": [1], "final_return": [-80.0]})
    logged = logs.assign(alpha0=1.0, episode_return=-90.0)
    assert study_sections.caption(view, {"logged": logged}, logs)


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
