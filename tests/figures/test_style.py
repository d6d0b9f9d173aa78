"""A figure looks the same on every machine, to every reader, and in every file."""

import itertools
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pandas as pd
import pytest
import report_inputs
import synthetic
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from reacher_shaping.figures import interactive, paper, parts, style
from reacher_shaping.figures.style import LOOKS, SPARE_COLORS, save, to_bytes, variant_color
from reacher_shaping.labels import variant_label, variant_order

DRAW = """
import sys
sys.path.insert(0, "tests")
import pandas as pd, synthetic
from reacher_shaping.analysis.learning_curves import curve_table
from reacher_shaping.figures import paper
from reacher_shaping.figures.style import to_bytes
curves = curve_table(synthetic.progress(synthetic.TOY_GRID, 2))
sys.stdout.buffer.write(to_bytes(paper.figure_1(curves), "svg"))
"""
HOSTILE = """
text.usetex: True
axes.facecolor: black
axes.titlesize: 40
axes.labelcolor: white
figure.constrained_layout.use: False
figure.autolayout: True
font.family: monospace
lines.linewidth: 9
lines.marker: o
patch.force_edgecolor: True
path.sketch: 1, 100, 2
svg.fonttype: path
savefig.facecolor: black
savefig.bbox: tight
xtick.labelsize: 30
axes.prop_cycle: cycler('color', ['#ff0000'])
"""


@pytest.fixture(scope="module")
def figure():
    return paper.figure_2(synthetic.cells(synthetic.TOY_GRID, 2), synthetic.published())


@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_same_tables_give_same_bytes(figure, kind):
    again = paper.figure_2(synthetic.cells(synthetic.TOY_GRID, 2), synthetic.published())
    assert to_bytes(figure, kind) == to_bytes(again, kind)


def test_a_figure_is_saved_in_three_formats(tmp_path, figure):
    paths = save(figure, tmp_path / "new" / "figure_2")
    assert [path.name for path in paths] == ["figure_2.svg", "figure_2.pdf", "figure_2.png"]
    assert sorted(path.name for path in paths[0].parent.iterdir()) == sorted(path.name for path in paths)


def test_a_persons_matplotlibrc_changes_nothing(tmp_path):
    (tmp_path / ".config" / "matplotlib").mkdir(parents=True)
    (tmp_path / ".config" / "matplotlib" / "matplotlibrc").write_text(HOSTILE)
    drawn = []
    for home in (None, tmp_path):
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith(("XDG_", "MPL", "MATPL"))
        }
        environment |= {"HOME": str(home)} if home else {}
        done = subprocess.run([sys.executable, "-c", DRAW], env=environment, capture_output=True, check=True)
        drawn.append(done.stdout)
    assert b"Constant shaping" in drawn[0]
    assert drawn[0] == drawn[1]


def test_text_of_an_svg_is_text(figure):
    tree = ElementTree.fromstring(to_bytes(figure, "svg").decode())
    texts = {"".join(element.itertext()) for element in tree.iter("{http://www.w3.org/2000/svg}text")}
    assert {"Main grid", "none", "decay", "200K", "published (one run)"} <= texts


def test_paths_are_kept_short_and_numbers_in_text_whole():
    cells = synthetic.cells(synthetic.PAPER_GRID)
    picture = to_bytes(paper.figure_2(cells, synthetic.published(), controllers=synthetic.controllers()), "svg")
    assert len(picture) < 60_000
    undefined = to_bytes(paper.figure_3(synthetic.correlation(r=(0.123, 0.9, 0, 0, 0, 0))), "svg")
    assert b"0.12" in undefined


def test_a_path_made_short_goes_through_the_same_points():
    long = b"M 1.26 2.0 \nL -3.04 4 \nL 5.55 6 \nC 1 2 3 4 5.19 6 \nL 7.0 8 \nL 9 10 \nz\nM 1 1 \nL 2 2 \n"
    assert style._short(long) == b"M 1.3 2 -3 4 5.5 6 C 1 2 3 4 5.2 6 L 7 8 9 10 z M 1 1 2 2"


def test_svg_turns_dark_for_readers_who_ask_for_it(figure):
    assert to_bytes(figure, "svg").count(b"prefers-color-scheme: dark") == 1


def test_every_variant_has_its_own_colour_whatever_else_is_in_the_study():
    names = [*synthetic.MAIN, *synthetic.L2SQ]
    assert len({variant_color(name) for name in names}) == len(names)
    assert variant_color("decay50k") == variant_color("decay50k") in SPARE_COLORS


# Machado, Oliveira and Fernandes (2009), full deuteranopia, on linear RGB.
DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)


def _lab(color, seen=DEUTERANOPIA):
    """CIELAB of a colour as it is seen [3], D65."""
    srgb = np.array(to_rgb(color))
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(seen @ linear, 0, 1)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(np.maximum(to_xyz @ linear / [0.9505, 1, 1.089], 0.008856))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def _unlike(one, other):
    """Whether two patterns of dashes are told apart at a glance: other strokes, or a period longer by half."""
    if len(one) != len(other):
        return True
    return bool(one) and max(sum(one), sum(other)) > 1.5 * min(sum(one), sum(other))


def test_lines_of_a_figure_are_told_apart_under_deuteranopia_by_colour_or_dashes():
    """Over what is drawn: every variant that has a look, one that has none, and `none` as a borrowed line."""
    names = [*LOOKS, "a variant of somebody's"]
    assert len({one.marker for one in LOOKS.values()}) == len(LOOKS)
    frame = pd.DataFrame([{"variant": name, "x": x, "y": x, "low": x, "high": x} for name in names for x in (0, 1)])
    frame = pd.concat([frame.assign(borrowed=False), frame[frame["variant"] == "none"].assign(borrowed=True)])
    (axes,) = parts.lines(Figure(), frame, "x", "y", {}, {})
    lines = [(line.get_color(), line._unscaled_dash_pattern[1] or ()) for line in axes.lines]
    assert len(lines) == len(names) + 1
    for (color, dashes), (other, more) in itertools.combinations(lines, 2):
        apart = np.linalg.norm(_lab(color) - _lab(other))
        assert apart > 15 or _unlike(dashes, more), (color, dashes, other, more, apart)


def test_chart_of_the_page_draws_each_variant_in_its_colour_and_dashes():
    frame = report_inputs.curves(synthetic.PAPER_GRID)
    chart = json.loads(interactive.learning_curves(frame).to_json())
    lines = next(layer["encoding"] for layer in chart["layer"] if layer["mark"]["type"] == "line")
    names = sorted(set(frame["variant"]), key=variant_order)
    assert len(names) > 6
    looks = {"color": [LOOKS[name].color for name in names], "strokeDash": [list(LOOKS[name].dashes) for name in names]}
    for channel, scale in looks.items():
        assert lines[channel]["scale"] == {"domain": [variant_label(name) for name in names], "range": scale}
