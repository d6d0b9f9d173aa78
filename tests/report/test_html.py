"""The report is one file without outside resources, and its numbers are those of the tables it was given."""

import base64
import re
from html.parser import HTMLParser
from pathlib import Path

import jinja2
import numpy as np
import pytest
import synthetic
from matplotlib.figure import Figure

from reacher_shaping.analysis import comparisons, learning_curves, single_seed_studies
from reacher_shaping.analysis.baselines import peer_table
from reacher_shaping.analysis.runs import LEARNED
from reacher_shaping.figures.style import save
from reacher_shaping.report import captions, html, paper_tables
from reacher_shaping.report.summary import short_number, summary
from reacher_shaping.settings.study import load_study

ROOT = Path(__file__).parents[2]
LOADING = ("img", "script", "link", "iframe", "video", "source", "object", "embed", "audio")
MANIFEST = {
    "git": {"commit": "0123456789abcdef0123", "dirty": True},
    "machine": {"cpu": "A processor", "cores": 2, "system": "Linux"},
    "threads": 1,
    "versions": {"python": "3.11.7", "torch": "2.13.0"},
    "env_steps": 5_000_000,
    "wall_seconds": 900.0,
    "cpu_seconds": 890.0,
    "env_steps_per_second": 5555.6,
}


class Page(HTMLParser):
    """What a page loads, links to, anchors and says."""

    def __init__(self, html):
        super().__init__()
        self.loaded, self.links, self.ids, self.words, self.rows, self.open = [], [], [], [], [], []
        self.in_entry = False
        self.feed(html)
        self.close()
        self.rows = [[entry.strip() for entry in row] for row in self.rows]
        self.text = re.sub(r"\s+", " ", " ".join(self.words))

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag in LOADING:
            self.loaded += [attributes[name] for name in ("src", "href", "data", "poster") if attributes.get(name)]
        if tag == "a":
            self.links.append(attributes["href"])
        self.ids += [attributes["id"]] if "id" in attributes else []
        if tag in ("style", "script"):
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self.in_entry = True

    def handle_endtag(self, tag):
        if tag in ("style", "script"):
            self.open.remove(tag)
        self.in_entry = self.in_entry and tag not in ("td", "th")

    def handle_data(self, data):
        if not self.open:
            self.words.append(data)
            if self.in_entry:
                self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def study():
    return load_study(ROOT / "config.yaml").model_dump(mode="json")


def _inputs(folder, study, grid, seeds, **changes):
    cells = synthetic.cells(grid, seeds)
    sizes = {"figure_1": (2, 1), "figure_2": (1, 2), "lottery": (1, 1), "forest": (2, 2), "peers": (3, 1)}
    figures = {name: Figure(figsize=size) for name, size in sizes.items()}
    paths = {name: save(figure, folder / "figures" / name, ("svg", "pdf"))[0] for name, figure in figures.items()}
    (folder / "media").mkdir()
    for key in grid:
        for kind in ("gif", "mp4"):
            name = f"{key[0]}-{key[1]}-{key[2]}-alpha{key[3]:g}.{kind}"
            (folder / "media" / name).write_bytes(kind.encode() + bytes(range(200)))
    runs = synthetic.runs(grid, seeds)
    studies = single_seed_studies.single_seed_studies(runs, np.random.default_rng(0), 50)
    given = {
        "study": study, "cells": cells, "runs": runs, "published": synthetic.published(),
        "correlation": synthetic.correlation(), "claims": synthetic.claims(), "controllers": synthetic.controllers(),
        "power": comparisons.power_frame(runs, synthetic.published()), "variance": comparisons.variance_frame(runs),
        "winners": single_seed_studies.winners_frame(studies), "spread": single_seed_studies.spread_frame(studies),
        "peers": synthetic.peers(), "figures": paths,
        "media": sorted((folder / "media").iterdir()), "manifests": [MANIFEST] * 3,
        "notebooks": [folder / "results" / "notebooks" / "story.ipynb"], "settings_hash": "ab" * 32,
        "ledger": [{"id": "C1", "evidence": "thirteen of fifteen", "shown_in": ["figure_2", "figure_4"]}],
        "folder": folder / "report", "template": html.TEMPLATE,
    }  # fmt: skip
    return html.Inputs(**(given | changes))


@pytest.fixture(scope="module")
def inputs(tmp_path_factory, study):
    return _inputs(tmp_path_factory.mktemp("study"), study, synthetic.PAPER_GRID, 3)


@pytest.fixture(scope="module")
def page(inputs):
    return Page(html.build(inputs))


def test_nothing_is_loaded_from_outside_the_file(page, inputs):
    assert page.loaded
    assert all(source.startswith("data:") for source in page.loaded)
    style = html.build(inputs).split("<style>")[1].split("</style>")[0]
    assert "url(" not in style
    assert "@import" not in style


def test_same_inputs_give_the_same_report(inputs):
    assert html.build(inputs) == html.build(inputs)


def test_figures_are_the_given_files(page, inputs):
    encoded = [source.split(",")[1] for source in page.loaded if source.startswith("data:image/svg")]
    assert [base64.b64decode(text) for text in encoded] == [path.read_bytes() for path in inputs.figures.values()]
    assert page.ids.index("seeds") < page.ids.index("lottery") < page.ids.index("further") < page.ids.index("forest")
    assert page.ids.index("forest") < page.ids.index("peers") < page.ids.index("claims")


def test_every_cell_has_its_video_and_mp4_goes_before_gif(page):
    videos = [base64.b64decode(source.split(",")[1]) for source in page.loaded if source.startswith("data:video/mp4")]
    assert len(videos) == len(synthetic.PAPER_GRID)
    assert all(content.startswith(b"mp4") for content in videos)


def test_videos_over_the_size_budget_are_linked(inputs, monkeypatch):
    monkeypatch.setattr(html, "MEDIA_BUDGET", 450)
    shown = html.videos(inputs, inputs.cells)
    assert [video.source.startswith("data:") for video in shown] == [True] * 2 + [False] * 21
    assert shown[2].source == "../media/paper-l2-500000-alpha1.mp4"


def test_links_inside_the_page_lead_somewhere_and_files_are_relative(page):
    inside = {link[1:] for link in page.links if link.startswith("#")}
    assert inside <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    files = [link for link in page.links if not link.startswith(("#", "https://"))]
    assert "../figures/figure_1.pdf" in files
    assert "../results/notebooks/story.ipynb" in files
    assert not [link for link in files if link.startswith("/")]


def test_tables_hold_the_values_of_the_cells(page, inputs):
    for name, make in (("table_2", paper_tables.table_2), ("table_3", paper_tables.table_3)):
        for row in paper_tables.readable(make(inputs.cells, inputs.published)).to_numpy().tolist():
            assert [entry.replace(" [", "[") for entry in row] in page.rows, name


def test_measures_power_variance_and_lottery_are_shown(page, inputs):
    for name, make in (
        ("behaviour", paper_tables.behaviour(inputs.cells)),
        ("learning", paper_tables.learning(inputs.cells, inputs.runs)),
    ):
        for row in paper_tables.readable(make).to_numpy().tolist():
            assert [entry.replace(" [", "[") for entry in row] in page.rows, name
    gain = inputs.power["published_gain"].max()  # of l2 and of decay300k
    assert [row for row in page.rows if row[0] == "decay 300K" and row[3] == f"{gain:.3f}"]
    assert "seeds of this study would have a power of" in page.text
    assert "of the variance of the success rate over runs is between seeds" in page.text
    assert [row[0] for row in page.rows if row[0].startswith("Success rate of")] == ["Success rate of the best cell"]
    assert f"{len(inputs.winners)} cells could have come out best" in page.text


def test_share_within_radius_may_be_missing(inputs):
    older = inputs.cells.drop(columns=[name for name in inputs.cells if "share_within_radius" in name])
    page = Page(html.build(_changed(inputs, cells=older)))
    assert "Share of steps within the radius" not in [entry for row in page.rows for entry in row]
    assert "Step of the first hit" in [entry for row in page.rows for entry in row]


def test_peers_stand_beside_none_and_their_budgets_are_said(page, inputs):
    table = peer_table(inputs.peers, inputs.cells, inputs.controllers)
    for row in paper_tables.readable(table).to_numpy().tolist():
        assert [entry.replace(" [", "[") for entry in row] in page.rows
    assert "PPO 500K (3 seeds), SAC 100K (3 seeds), TD3 100K (3 seeds)" in page.text
    without = _changed(inputs, peers=None, figures={name: p for name, p in inputs.figures.items() if name != "peers"})
    text = Page(html.build(without)).text
    assert "No other algorithms have been trained" in text
    assert "TD3 100K" not in text


def test_diverged_runs_are_counted_everywhere(inputs):
    runs = synthetic.diverge(inputs.runs, "l2", 1)
    page = Page(html.build(_changed(inputs, runs=runs, cells=synthetic.summary(runs))))
    assert "69 training runs, of which 3 diverged" in page.text
    assert next(row for row in page.rows if row[0] == "L2")[1] == "3 (1 diverged)"
    assert "3 of these 51 runs diverged: past its last finite return" in page.text  # the main grid's curves
    assert "3 of these 69 runs diverged (see Seeds)" in page.text
    assert page.text.count("3 (1 diverged)") >= 12
    assert "nan" not in page.text


def test_setup_is_read_from_the_configuration(page, study, inputs):
    assert ["ppo: learning rate", "0.0003 (paper 3.2)"] in page.rows
    changed = {**study, "evaluation": {"episodes": 1234, "radius": 0.03}, "sources": {}}
    changed["protocols"] = {"paper": study["protocols"]["paper"] | {"ppo": {"learning_rate": 0.5}}}
    other = Page(html.build(_changed(inputs, study=changed)))
    assert ["ppo: learning rate", "0.5"] in other.rows
    assert "evaluated on 1,234 episodes" in other.text
    assert "within 30 mm of the target" in other.text


def _changed(inputs, **changes):
    return html.Inputs(**({name: getattr(inputs, name) for name in inputs.__dataclass_fields__} | changes))


def test_claims_come_with_effect_verdict_and_evidence(page):
    row = next(row for row in page.rows if row[0] == "C1")
    assert row[1].startswith("Shaping improves success over none")
    assert "thirteen of fifteen" in row[1]
    assert row[2] == "0.051"
    assert row[3] == "0.010, 95 % interval \N{MINUS SIGN}0.020 to 0.040"
    assert row[4] == "? inconclusive"
    assert row[5].startswith("Figure 2")


def test_manifests_are_summed(page):
    rows = dict(row for row in page.rows if len(row) == 2)
    assert rows["Code"] == "0123456789ab with uncommitted changes"
    assert rows["Environment steps"] == "15,000,000"
    assert rows["Training time, all jobs"].startswith("0.75 h wall")
    assert rows["Versions"] == "python 3.11.7, torch 2.13.0"


def test_no_result_stands_in_the_template():
    """Every number with decimals in the template's prose would be a typed-in result."""
    source = (html.TEMPLATE).read_text(encoding="utf-8")
    body = re.sub(r"<style>.*?</style>|<script>.*?</script>|\{[{%].*?[%}]\}|<[^>]*>", " ", source, flags=re.DOTALL)
    prose = body.split("References")[0]
    assert not re.findall(r"\d+\.\d+|\d+\s*%|\d{3,}", re.sub(r"\(Ng et al\. 1999\)", "", prose))


def test_toy_study_without_the_rest_says_what_is_missing(tmp_path, study):
    bare = _inputs(
        tmp_path, study, synthetic.TOY_GRID, 2,
        correlation=None, claims=None, controllers=None, figures={}, media=[], manifests=[], notebooks=[], ledger=[],
        power=None, variance=None, winners=None, spread=None, peers=None,
    )  # fmt: skip
    text = Page(html.build(bare)).text
    for words in (
        "This figure has not been drawn.", "claims have not been tested", "No rollouts have been rendered.",
        "No manifests were given.", "No such cells in this study.", "How many seeds it takes has not been computed.",
        "The variance has not been split.", "No other algorithms have been trained",
    ):  # fmt: skip
        assert words in text


def test_markup_in_a_table_is_shown_not_run(inputs):
    claims = synthetic.claims().assign(claim="<script>alert(1)</script>")
    assert "<script>alert" not in html.build(_changed(inputs, claims=claims))


def test_template_naming_something_unknown_is_an_error(tmp_path, inputs):
    template = tmp_path / "report.html.j2"
    template.write_text("{{ no_such_thing }}", encoding="utf-8")
    with pytest.raises(jinja2.UndefinedError, match="no_such_thing"):
        html.build(_changed(inputs, template=template))


def test_headline_names_the_best_shaped_cell_and_the_baseline():
    cells = synthetic.cells(synthetic.PAPER_GRID).assign(success_rate=0.2, success_rate_low=0.1, success_rate_high=0.3)
    best = (cells["variant"] == "decay300k") & (cells["budget"] == 1_000_000)
    cells.loc[best, ["success_rate", "success_rate_low", "success_rate_high"]] = [0.5, 0.25, 0.6]
    (sentence, _) = summary(cells, None).headline
    assert "decay 300K (1M, α₀ = 1): 50.0 % [25.0, 60.0]" in sentence
    assert "20.0 % [10.0, 30.0] after 500K steps and 20.0 % [10.0, 30.0] after 1M steps" in sentence
    assert "The intervals of the two at 1M overlap." in sentence
    cells.loc[best, "success_rate_low"] = 0.31
    assert "The intervals of the two at 1M are apart." in summary(cells, None).headline[0]


@pytest.mark.parametrize(
    ("verdicts", "short"),
    [
        (("reproduced", "reproduced"), "As the paper says."),
        (("not reproduced", "not reproduced"), "Not as the paper says."),
        (("reproduced", "not reproduced"), "In part as the paper says."),
        (("reproduced", "inconclusive"), "In part as the paper says, in part open."),
        (("not reproduced", "untestable"), "Not shown, in part open."),
        (("inconclusive", "untestable"), "These runs cannot tell."),
    ],
)
def test_short_answers_follow_the_verdicts(verdicts, short):
    claims = synthetic.claims().iloc[:2].assign(id=["C2", "C3"], verdict=list(verdicts))
    found = {answer.question: answer.short for answer in summary(synthetic.cells(synthetic.TOY_GRID), claims).answers}
    assert found["Does a decaying weight help further?"] == short
    assert found["Does potential-based shaping speed PPO's learning up?"] == "Not tested."


def test_effects_have_about_three_digits_and_no_exponent():
    values = [short_number(value) for value in (0.01234, 1.234, 12.34, 123456.7, np.nan)]
    assert values == ["0.012", "1.23", "12.3", "123457", "\N{EN DASH}"]


def test_captions_count_diverged_runs_of_their_own_groups():
    runs = synthetic.diverge(synthetic.runs(synthetic.PAPER_GRID, 3), "decay200k_l2sq")
    cells = synthetic.summary(runs)
    assert "2 of these 18 runs diverged" in captions.caption("figure_4", cells)
    assert "Crosses are the runs that diverged, 2 of 69" in captions.caption("seed_strip", cells)
    assert "diverged" not in captions.caption("figure_1", cells)
    assert "diverged" not in captions.caption("figure_4", synthetic.cells(synthetic.PAPER_GRID, 3))


def test_caption_of_smoothness_says_how_it_is_defined():
    text = captions.caption("learning", synthetic.cells(synthetic.PAPER_GRID, 3))
    assert f"moving average over {learning_curves.WINDOW} iterations" in text
    assert f"the first {100 * learning_curves.BURN_IN:g} % of training" in text
    assert f"made {100 * LEARNED:g} % of the way" in text


def test_captions_count_seeds_and_episodes_from_the_tables():
    cells, runs = synthetic.cells(synthetic.PAPER_GRID, 7), synthetic.runs(synthetic.PAPER_GRID, 7)
    text = captions.caption("figure_2", cells, runs)
    assert "1,000 evaluation episodes" in text
    assert "mean over 7 seeds" in text
    assert "95 % t over seeds" in text
    assert captions.title("figure_2") == "Figure 2. Success rates"
    assert captions.caption("figure_1", synthetic.cells(synthetic.TOY_GRID, 1)).count("1 seed ") == 1
