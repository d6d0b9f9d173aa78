"""The further studies' figures show the numbers of their tables."""

import drawn
import numpy as np
import pandas as pd
import pytest
import switched
import synthetic
from switched import LOGS

from reacher_shaping.figures import studies
from reacher_shaping.figures.style import to_bytes


@pytest.fixture(scope="module")
def effects():
    return switched.effects()


@pytest.fixture(scope="module")
def released():
    return switched.released()


def test_effects_figure_has_each_difference_with_its_interval(effects):
    figure = studies.effects(effects)
    for axes, metric in zip(figure.axes, studies.EFFECT_LABELS, strict=True):
        shown = effects[(effects["metric"] == metric) & (effects["effect"] != "interaction")].sort_values("difference")
        marks = sorted(drawn.filled(axes))
        assert [x for x, _, _ in marks] == pytest.approx(shown["difference"].tolist())
        ends = sorted(tuple(ends[:, 0]) for ends in drawn.segments(axes))
        assert ends == sorted(zip(shown["ci_low"], shown["ci_high"], strict=True))
        clear = (shown["ci_low"] > 0) | (shown["ci_high"] < 0)
        assert [clear for _, _, clear in marks] == clear.tolist()
    axes = figure.axes[0]
    assert any(clear for _, _, clear in drawn.filled(axes))
    assert [label.get_text() for label in axes.get_yticklabels()] == [
        "all switches", "a\nepochs 10 to 5", "b\ndiscount 0.99 to 0.5",
    ]  # fmt: skip


def test_effects_without_rows_are_an_empty_figure(effects):
    assert to_bytes(studies.effects(effects.head(0)), "svg")


def test_cells_figure_has_a_dot_per_run_in_every_panel(released):
    controllers = synthetic.controllers().assign(protocol="released", mode="stochastic", final_success_rate=1.0)
    controllers.loc[3, "controller"] = "inverse kinematics + PD"
    figure = studies.cells(released["runs"], released["cells"], controllers)
    for axes, metric in zip(figure.axes, studies.STRIP, strict=True):
        assert sorted(x for x, _ in drawn.runs(axes)) == pytest.approx(sorted(released["runs"][metric]))
    ceilings = [line.get_xdata()[0] for axes in figure.axes for line in axes.lines if line.get_label() == "_controller"]
    rows = (released["cells"]["protocol"] == "released").sum()  # the other protocol has no controllers here
    assert sorted(ceilings) == sorted([1.0, 1.0, -3.7] * rows)
    without = studies.cells(released["runs"], released["cells"])
    assert not [line for axes in without.axes for line in axes.lines if line.get_label() == "_controller"]


def test_log_figure_sets_the_published_peak_and_end_beside_the_curve_of_the_same_budget():
    key = {"protocol": "released", "variant": "none", "alpha0": 1.0, "seeds": 5, "low": np.nan, "high": np.nan}
    parts = [
        pd.DataFrame({"iteration": np.arange(1, 246), "episode_return": -50.0, "budget": budget, **key})
        for budget in (500_000, 1_000_000)
    ]
    parts.append(parts[0].assign(alpha0=0.5))  # a label of other runs than the published log's
    figure = studies.log(pd.concat(parts), LOGS)
    marks = [line for axes in figure.axes for line in axes.lines if line.get_label() == "_published"]
    assert [list(line.get_xdata()) for line in marks] == [[33, 245]]
    assert [list(line.get_ydata()) for line in marks] == [[-38.6, -87.2]]
    assert marks[0] in figure.axes[0].lines


def test_log_figure_shows_the_moving_average_in_which_the_published_log_is_told():
    key = {"protocol": "released", "variant": "none", "budget": 500_000, "seeds": 5, "low": np.nan, "high": np.nan}
    curve = -50 - 10 * np.sin(np.arange(245.0))
    parts = [
        pd.DataFrame({"iteration": np.arange(1, 246), "episode_return": curve, "alpha0": a, **key}) for a in range(5)
    ]
    figure = studies.log(pd.concat(parts).sample(frac=1, random_state=2), LOGS)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == 5
    assert shown[2].get_position().y1 < shown[0].get_position().y0, "more than three settings stand in rows of two"
    (line,) = drawn.data_lines(shown[0])
    np.testing.assert_allclose(line.get_ydata(), np.convolve(curve, np.ones(20) / 20, mode="valid"))
    assert (line.get_xdata()[0], line.get_xdata()[-1]) == (20, 245)


def test_correlation_figure_has_a_panel_each_for_the_published_and_ours(released):
    figure = studies.correlation(released["correlation"])
    titles = [axes.get_title(loc="left") for axes in figure.axes[:2]]
    assert titles == ["Published Table 2", "Released code, labels as published"]
    table = released["correlation"]
    for axes, level in zip(figure.axes[:2], ("published", "cells"), strict=True):
        chosen = table[(table["level"] == level) & (table["method"] == "pearson")]
        own = chosen[(chosen["x"] == "alpha0") & (chosen["y"] == "mean_return")]["r"].iloc[0]
        assert any(text.get_text().startswith(f"{own:.2f}") for text in axes.texts), level


def test_log_figure_sets_the_unshaped_runs_beside_the_shaped_ones_of_another_weight():
    key = {"protocol": "tuned", "budget": 500_000, "seeds": 5, "low": np.nan, "high": np.nan, "episode_return": -5.0}
    parts = [
        pd.DataFrame({"iteration": np.arange(1, 246), "variant": variant, "alpha0": alpha0, **key})
        for variant, alpha0 in (("none", 1.0), ("l2", 3.6))
    ]
    (axes,) = studies.log(pd.concat(parts), LOGS).axes
    assert sorted(drawn.curves(axes, synthetic.MAIN)) == ["l2", "none"]
    assert axes.get_title(loc="left") == "tuned\n500K, α₀ = 3.6"


def test_dose_figure_has_a_dot_per_run_and_each_mean_at_its_weight_under_its_protocol():
    rng = np.random.default_rng(0)
    weights = [("none", 1.0), ("l2", 1.0), ("l2", 10.0), ("l2", 50.0)]
    keys = [(protocol, *key) for protocol in ("p", "q") for key in weights] + [("r", "l2", 1.0)]
    runs = pd.DataFrame(
        [
            {"protocol": protocol, "variant": variant, "budget": 500, "alpha0": alpha0, "seed": seed}
            | {"final_success_rate": rng.uniform()}
            for protocol, variant, alpha0 in keys
            for seed in range(4)
        ]
    )
    name = "final_success_rate"
    cells = runs.groupby(["protocol", "variant", "budget", "alpha0"], as_index=False)[name].mean()
    cells[f"{name}_low"], cells[f"{name}_high"] = cells[name] - 0.1, cells[name] + 0.1
    figure = studies.dose(runs, cells)
    assert len(figure.axes) == 2, "the third protocol has one weight"
    for axes, protocol in zip(figure.axes, ("p", "q"), strict=True):
        assert [label.get_text() for label in axes.get_xticklabels()] == ["none", "1", "10", "50"]
        offsets = [np.asarray(part.get_offsets()) for part in axes.collections]
        marks = [(round(float(x)), float(y)) for x, y in np.concatenate([part for part in offsets if len(part) > 1])]
        expected = [
            (weights.index((row["variant"], row["alpha0"])), row[name])
            for frame in (runs, cells)
            for row in frame[frame["protocol"] == protocol].to_dict("records")
        ]
        np.testing.assert_allclose(sorted(marks), sorted(expected))
