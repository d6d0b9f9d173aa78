"""The figures of a study with hypotheses show every run and every square of their tables."""

import drawn
import numpy as np
import pandas as pd
import pytest

from reacher_shaping.figures import hypotheses
from reacher_shaping.figures.style import to_bytes

CELLS = [("p", "none", 1.0), ("p", "l2", 1.0), ("p", "l2", 50.0), ("q", "l2", 50.0)]


def shown(figure, rows, columns):
    panels = np.array(figure.axes[: rows * columns]).reshape(rows, columns)
    return {(row, column): axes for (row, column), axes in np.ndenumerate(panels) if axes.get_visible()}


def test_take_off_figure_has_a_line_per_run_in_the_panel_of_its_cell():
    rows = [
        {"protocol": protocol, "variant": variant, "alpha0": alpha0, "budget": 500, "seed": seed, "iteration": step}
        | {"env_steps": 1000 * step, "success_rate": (place + seed + step) / 30}
        for place, (protocol, variant, alpha0) in enumerate(CELLS)
        for seed in range(3)
        for step in (5, 10, 15)
    ]
    panels = shown(hypotheses.takeoff(pd.DataFrame(rows).sample(frac=1, random_state=0)), 2, 3)
    places = {(0, 0): 0, (0, 1): 1, (0, 2): 2, (1, 2): 3}
    assert panels.keys() == places.keys()
    titles = [panels[0, column].get_title().split("\n") for column in range(3)]
    assert titles == [["none"], ["L2", "α₀ = 1"], ["L2", "α₀ = 50"]]
    assert panels[1, 2].get_title() == "", "the panel above has the same cell"
    assert not [axes for axes in panels.values() if axes.get_title(loc="left")], "seaborn's own are gone"
    named = {key: [text.get_text() for text in axes.texts] for key, axes in panels.items()}
    assert named == {(0, 0): ["p"], (0, 1): [], (0, 2): [], (1, 2): ["q"]}
    for key, place in places.items():
        lines = sorted(tuple(line.get_ydata()) for line in drawn.data_lines(panels[key]))
        expected = [tuple((place + seed + step) / 30 for step in (5, 10, 15)) for seed in range(3)]
        np.testing.assert_allclose(lines, expected)


def test_map_shows_the_share_of_misses_at_each_square():
    rows = [
        {"protocol": protocol, "variant": variant, "alpha0": alpha0, "budget": 500, "target_x": x, "target_y": y}
        | {"episodes": 10, "final_success_rate": 0.1 * place + (x > 0) / 4 + (y > 0) / 8}
        for place, (protocol, variant, alpha0) in enumerate(CELLS)
        for x in (-0.02, 0.02, 0.06)
        for y in (-0.06, -0.02, 0.02)
    ]
    panels = shown(hypotheses.targets(pd.DataFrame(rows)), 2, 3)
    for key, place in {(0, 0): 0, (0, 1): 1, (0, 2): 2, (1, 2): 3}.items():
        (mesh,) = panels[key].collections
        missed = np.ma.filled(mesh.get_array(), np.nan)
        middles = mesh.get_coordinates()[:-1, :-1] + hypotheses.SQUARE / 2
        seen = {
            (round(x, 3), round(y, 3)): value
            for (x, y), value in zip(middles.reshape(-1, 2), missed.ravel(), strict=True)
        }
        assert np.isfinite(list(seen.values())).sum() == 9
        for row in rows[9 * place : 9 * place + 9]:
            assert seen[row["target_x"], row["target_y"]] == pytest.approx(1 - row["final_success_rate"])


def test_tables_without_rows_are_empty_figures():
    columns = ["protocol", "variant", "alpha0", "budget"]
    for draw in (hypotheses.takeoff, hypotheses.targets):
        assert to_bytes(draw(pd.DataFrame(columns=columns)), "svg")
