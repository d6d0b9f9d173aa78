"""A figure looks the same on every machine, to every reader, and in every file."""

import itertools
import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import synthetic
from matplotlib.colors import to_rgb

from reacher_shaping.figures import paper
from reacher_shaping.figures.style import LOOKS, SPARE_COLORS, save, to_bytes, variant_color

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


def test_variants_are_told_apart_under_deuteranopia_by_colour_or_dashes():
    for one, other in itertools.combinations(LOOKS.values(), 2):
        apart = np.linalg.norm(_lab(one.color) - _lab(other.color))
        assert one.marker != other.marker
        assert apart > 15 or one.dashes != other.dashes, (one, other)
