"""The report is one file without outside resources, and its numbers are those of the tables it was given."""

import base64
import dataclasses
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import jinja2
import numpy as np
import pandas as pd
import pytest
import report_inputs
import synthetic

from reacher_shaping.analysis import learning_curves
from reacher_shaping.analysis.baselines import peer_table
from reacher_shaping.analysis.runs import LEARNED
from reacher_shaping.report import captions, claims_view, html, paper_tables, pictures
from reacher_shaping.report.quantities import in_words
from reacher_shaping.report.summary import summary
from reacher_shaping.report.text import entry
from reacher_shaping.settings.study import load_study
from reacher_shaping.storage.files import ArtifactError
from reacher_shaping.storage.reference import read_tables

ROOT = Path(__file__).parents[2]
LOADING = ("img", "script", "link", "iframe", "video", "source", "object", "embed", "audio")


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
        if tag in ("style", "script", "caption"):
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self.in_entry = True

    def handle_endtag(self, tag):
        if tag in ("style", "script", "caption"):
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


@pytest.fixture(scope="module")
def inputs(tmp_path_factory, study):
    return report_inputs.make(tmp_path_factory.mktemp("study"), study, synthetic.PAPER_GRID, 3)


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
    encoded = [source.split(",", 1)[1] for source in page.loaded if source.startswith("data:image/svg")]
    assert [unquote(text).encode() for text in encoded] == [path.read_bytes() for path in inputs.figures.values()]
    assert page.ids.index("seeds") < page.ids.index("lottery") < page.ids.index("further") < page.ids.index("forest")
    assert page.ids.index("short") < page.ids.index("claims") < page.ids.index("seeds")
    assert page.ids.index("forest") < page.ids.index("peers")


def test_every_cell_has_its_video_and_mp4_goes_before_gif(page):
    videos = [base64.b64decode(source.split(",")[1]) for source in page.loaded if source.startswith("data:video/mp4")]
    assert len(videos) == len(synthetic.PAPER_GRID)
    assert all(content.startswith(b"mp4") for content in videos)


def test_manifests_are_summed(page):
    rows = dict(row for row in page.rows if len(row) == 2)
    assert rows["Code"] == "0123456789ab with uncommitted changes"
    assert rows["Environment steps"] == "15,000,000"
    assert rows["Training time, all jobs"].startswith("0.75 h wall")
    assert rows["Versions"] == "python 3.11.7, torch 2.13.0"


def test_template_naming_something_unknown_is_an_error(tmp_path, inputs):
    template = tmp_path / "report.html.j2"
    template.write_text("{{ no_such_thing }}", encoding="utf-8")
    with pytest.raises(jinja2.UndefinedError, match="no_such_thing"):
        html.build(_changed(inputs, template=template))


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


def _changed(inputs, tables=None, **changes):
    files = inputs.study
    if tables is not None:
        files = dataclasses.replace(
            files, tables={n: t for n, t in {**files.tables, **tables}.items() if t is not None}
        )
    return dataclasses.replace(inputs, **{"study": files, **changes})


def _shown(table):
    return [[entry.replace(" [", " [") for entry in row] for row in paper_tables.readable(table).to_numpy().tolist()]


def test_videos_over_the_size_budget_are_left_out(inputs, monkeypatch):
    monkeypatch.setattr(pictures, "MEDIA_BUDGET", 450)
    shown = pictures.videos(inputs.media, inputs.study.tables["cells"])
    assert [video.name for video in shown] == ["paper-none-500000-alpha1", "paper-none-1000000-alpha1"]
    assert all(video.source.startswith("data:video/mp4") for video in shown)


def test_links_inside_the_page_lead_somewhere_and_only_notebooks_are_beside_it(page):
    inside = {link[1:] for link in page.links if link.startswith("#")}
    assert inside <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    files = [link for link in page.links if not link.startswith(("#", "https://", "data:text/csv"))]
    assert files == ["notebooks/story.html"]


def test_tables_hold_the_values_of_the_cells(page, inputs):
    tables = inputs.study.tables
    cells, published = tables["cells"], inputs.study.published
    for table in (
        paper_tables.table_2(cells, published),
        paper_tables.table_3(cells, published),
        paper_tables.behaviour(cells),
        paper_tables.learning(cells, tables["runs"]),
        paper_tables.robust(tables["scores"]),
        peer_table(tables["peers"], cells, tables["controllers"]),
    ):
        for row in _shown(table):
            assert row in page.rows


def test_every_table_can_be_taken_along(page, inputs):
    files = [link for link in page.links if link.startswith("data:text/csv")]
    contents = [base64.b64decode(file.split(",")[1]).decode() for file in files]
    table = paper_tables.table_1(inputs.study.tables["cells"], inputs.study.published)
    assert table.to_csv(index=False, lineterminator="\n") in contents


def test_measures_power_variance_and_lottery_are_shown(page, inputs):
    gain = inputs.study.tables["power"]["published_gain"].max()  # of l2 and of decay300k
    assert [row for row in page.rows if row[0] == "decay 300K, 1M, α₀ = 1" and row[1] == f"{100 * gain:.1f}"]
    assert "seeds of this study would have a power of" in page.text
    assert "of the variance of the success rate over runs is between seeds" in page.text
    assert f"{len(inputs.study.tables['winners'])} cells could have come out best" in page.text


def test_share_within_radius_may_be_missing(inputs):
    cells = inputs.study.tables["cells"]
    older = cells.drop(columns=[name for name in cells if "share_within_radius" in name])
    page = Page(html.build(_changed(inputs, {"cells": older})))
    headings = [entry for row in page.rows for entry in row]
    assert "Steps within the radius (%)" not in headings
    assert "Step of the first hit" in headings


def test_budgets_of_peers_are_said_and_their_absence_too(page, inputs):
    assert "PPO 500K (3 seeds), SAC 100K (3 seeds), TD3 100K (3 seeds)" in page.text
    figures = {name: path for name, path in inputs.figures.items() if name != "peers"}
    text = Page(html.build(_changed(inputs, {"peers": None}, figures=figures))).text
    assert "No other algorithms have been trained" in text
    assert "TD3 100K" not in text


def test_diverged_runs_are_counted_everywhere(inputs):
    runs = synthetic.diverge(inputs.study.tables["runs"], "l2", 1)
    page = Page(html.build(_changed(inputs, {"runs": runs, "cells": synthetic.summary(runs)})))
    assert "69 training runs, of which 3 diverged" in page.text
    assert next(row for row in page.rows if row[0] == "L2")[1] == "3 (1 diverged)"
    assert "3 of these 51 runs diverged: past its last finite return" in page.text  # the main grid's curves
    assert "3 of these 69 runs diverged (see Seeds)" in page.text
    assert "nan" not in page.text


def test_setup_is_read_from_the_settings(page, study, inputs):
    assert ["ppo: learning rate", "0.0003 (paper 3.2)"] in page.rows
    changed = {**study, "evaluation": {"episodes": 1234, "radius": 0.03}, "sources": {}}
    changed["protocols"] = {"paper": study["protocols"]["paper"] | {"ppo": {"learning_rate": 0.5}}}
    other = Page(html.build(_changed(inputs, settings=changed, policies=None)))
    assert any(row[0] == "ppo: learning rate" and row[1].startswith("0.5") for row in other.rows if len(row) > 1)
    assert "evaluated on 1,234 episodes" in other.text
    assert "within 30 mm of the target" in other.text


def test_arm_is_drawn_and_counted_at_the_studys_radius(tmp_path, study, page, inputs):
    wide = {**study, "evaluation": {"episodes": 1000, "radius": 0.05}}
    built = html.build(report_inputs.make(tmp_path, wide, synthetic.TOY_GRID, 2))
    circles = re.findall(r'class="goal"[^>]* r="([\d.]+)"', built)
    assert len(circles) == 3  # the player's and one a path
    assert {float(one) for one in circles} == {50}
    assert '<rect class="band" x="0" y="87.5" width="300" height="12.5"/>' in built
    assert json.loads(built.split('getElementById("player"), ')[1].split(");")[0])["radius"] == 0.05
    with pytest.raises(ArtifactError, match=r"counts success at 0\.02 m, the study at 0\.05 m"):
        html.build(_changed(inputs, settings=wide))


def test_page_says_that_a_run_keeps_no_curves_of_single_seeds(page, inputs):
    words = "Curves of single seeds cannot be switched on"
    assert words not in page.text
    assert words in Page(html.build(_changed(inputs, {"seed_curves": None}))).text


def test_first_screen_leads_to_the_arm(inputs):
    first = Page(html.build(inputs).split('id="short"')[1].split("</section>")[0])
    assert "#arm" in first.links
    assert "#arm" not in Page(html.build(_changed(inputs, policies=None))).links


def test_the_main_study_is_introduced_by_its_title_and_question_as_the_others_are(inputs):
    headings = {"main": {"title": "Does it help?", "question": "With <several> seeds.", "seeds": 3}}
    told = html.build(_changed(inputs, headings=headings))
    assert "<p>Does it help? With &lt;several&gt; seeds.</p>" in told
    assert "Does it help?" not in html.build(inputs)


def test_toy_runs_are_marked(tmp_path, study, page):
    toy = Page(
        html.build(report_inputs.make(tmp_path, study, synthetic.TOY_GRID, 2, only=("cells", "runs"), figures={}))
    )
    assert "A toy run: 4,096 environment steps" in toy.text
    assert "toy run" not in page.text


def test_no_result_stands_in_the_words_or_the_template():
    """A number with decimals or a per cent sign in the prose would be a typed-in result."""
    template = html.TEMPLATE.read_text(encoding="utf-8")
    body = re.sub(r"<style>.*?</style>|<script>.*?</script>|\{[{%].*?[%}]\}|<[^>]*>", " ", template, flags=re.DOTALL)
    first = " ".join(str(entry(name)) for name in ("first", "questions", "short", "why"))
    for prose in (body, first.replace("95 % intervals", "").replace("{effect} %", "")):
        assert not re.findall(r"\d+\.\d+|\d+\s*%|\d{3,}", prose)


def test_toy_study_without_the_rest_says_what_is_missing(tmp_path, study):
    bare = report_inputs.make(
        tmp_path, study, synthetic.TOY_GRID, 2,
        only=("cells", "runs"), figures={}, media=[], manifests=[], notebooks=[],
    )  # fmt: skip
    page = Page(html.build(bare))
    for words in (
        "This figure has not been drawn.", "claims have not been tested", "No manifests were given.",
        "No such cells in this study.", "How many seeds it takes has not been computed.",
        "The variance has not been split.", "No other algorithms have been trained",
    ):  # fmt: skip
        assert words in page.text
    assert "rollouts" not in page.ids


def test_markup_in_a_table_is_shown_not_run(inputs):
    ledger = [{**inputs.study.ledger[0], "claim": "<script>alert(1)</script>"}]
    files = dataclasses.replace(inputs.study, ledger=ledger)
    built = html.build(dataclasses.replace(inputs, study=files))
    assert "&lt;script&gt;alert" in built
    assert "<script>alert" not in built


@pytest.mark.parametrize(
    ("verdict", "short"),
    [
        ("reproduced", "Yes."),
        ("not reproduced", "No."),
        ("inconclusive", "Not decided."),
        ("untestable", "Not tested."),
    ],
)
def test_answers_follow_the_verdicts(inputs, verdict, short):
    claims = synthetic.claims().assign(verdict=verdict)
    answers = summary(_changed(inputs, {"claims": claims}).study).answers
    assert {answer.short for answer in answers if answer.link in ("success", "training")} == {short}


def test_first_screen_counts_comparisons_beyond_chance_and_gives_the_effect(inputs):
    found = inputs.study.tables["comparisons"]
    own = (found["family"] == "none") & (found["metric"] == "success_rate")
    changed = found.assign(p_holm=np.where(own & (found["variant"] == "l2"), 0.01, 0.5))
    first = summary(_changed(inputs, {"comparisons": changed}).study).answers[0]
    assert "3 of 21 settings differ beyond chance" in first.because
    assert "Success changes by \N{MINUS SIGN}2.0 [\N{MINUS SIGN}5.0, 1.0] points" in first.because


@pytest.mark.parametrize(
    ("verdict", "short"), [("supported", "Yes."), ("contradicted", "No."), ("open", "Not decided.")]
)
def test_first_screen_says_when_shaping_helps_by_the_first_hypothesis_on_sparse_rewards(inputs, verdict, short):
    assert not [answer for answer in summary(inputs.study).answers if answer.link == "sparse"], "without such a study"
    sparse = read_tables(ROOT / "report/sparse_run")
    judged = sparse["hypotheses"].copy()
    judged.loc[0, ["verdict", "solved_a", "solved_b"]] = [verdict, 0.7, 0.2]
    experiments = {"sparse": {**sparse, "hypotheses": judged}}
    study = dataclasses.replace(inputs.study, experiments={**inputs.study.experiments, **experiments})
    (answer,) = (answer for answer in summary(study).answers if answer.link == "sparse")
    assert (answer.short, answer.because) == (short, "7 of 10 runs then learn, 2 without.")
    assert answer.more == f"Of 9 hypotheses these runs decide {0 if verdict == 'open' else 1}."


def test_picture_gives_no_interval_to_what_was_chosen_for_being_the_highest(inputs):
    bars = {bar.name: bar for bar in summary(inputs.study).bars if bar.ours}
    best = bars["ours, best of 21 shaped"]
    assert np.isfinite([bars["ours, no shaping"].low, bars["ours, no shaping"].high]).all()
    assert np.isnan([best.low, best.high]).all()


def test_report_says_what_its_intervals_do_not_know(inputs):
    page = " ".join(html.build(inputs).split())
    for words in (
        "Other resets would move all rates together by up to their binomial error",
        "a run that never gets there counted at its whole budget",
        "They were chosen for being the highest",
    ):
        assert words in page, words


def test_first_screen_names_the_published_run_that_the_tables_leave_out(inputs):
    left_out = pd.DataFrame(
        {"variant": ["none"], "budget": [500_000], "alpha0": [0.5], "run": ["lucky"], "success_rate": [0.296]}
    )
    every = pd.concat([inputs.study.published, left_out], ignore_index=True)
    files = dataclasses.replace(inputs.study, every_published=every)
    assert any("`lucky`" in reason and "29.6\N{NO-BREAK SPACE}%" in reason for reason in summary(files).why)
    lower = dataclasses.replace(files, every_published=every.replace(0.296, 0.1))
    assert not any("lucky" in reason for reason in summary(lower).why)


def test_claims_show_two_verdicts_and_what_they_are_worth(inputs):
    tables = inputs.study.tables
    (shown, *_) = claims_view.claims(inputs.study.ledger, tables)
    assert [verdict.word for verdict in shown.verdicts] == ["inconclusive", ""]
    both = claims_view.claims(
        inputs.study.ledger, tables, {**tables, "claims": synthetic.claims().assign(verdict="reproduced")}
    )
    assert [verdict.word for verdict in both[0].verdicts] == ["inconclusive", "reproduced"]
    details = dict(shown.details)
    assert any("About 45 runs a setting would decide." in text for text in details["What the verdict is worth"])
    assert "Changed because" in details["Tested here"][1]
    assert shown.measured == "\N{MINUS SIGN}2.0 [\N{MINUS SIGN}5.0, 1.0] points"
    assert 'aria-label="measured' in shown.picture


UNITS = {"points": " points", "percent": " %", "times": " times", "plain": "", "whole": ""}


def test_every_claim_says_where_the_paper_says_it_and_its_rule_in_the_unit_of_what_was_measured(inputs):
    shown = claims_view.claims(inputs.study.ledger, inputs.study.tables)
    ledger = {one["id"]: one for one in inputs.study.ledger}
    assert len(shown) > 5
    for claim in shown:
        one = ledger[claim.name]
        assert dict(claim.details)["The paper"] == [f"{in_words(one['evidence'])}."]
        (_, grid), *_ = claim.parts
        measured, holds = (grid.headings.index(name) for name in ("Measured [95 % interval]", "The claim holds"))
        for row, part in zip(grid.rows, claims_view.newest(one)["rules"], strict=True):
            unit = entry(f"estimates.{claim.name}")[part][1]
            assert row[measured].endswith(UNITS[unit]) or row[measured] == claims_view.DASH
            assert all(part.endswith(UNITS[unit]) for part in row[holds].split("; ")), (claim.name, row[holds])


def test_claims_speak_of_shares_in_percent_and_of_their_differences_in_points():
    plain = ("C4", "C10")  # of correlations
    for claim in (claim for claim in synthetic.ledger() if claim["id"] not in plain):
        assert re.search(r"Abstract|Section|Fig\.|Table|Appendix", claim["evidence"]), claim["id"]
        words = [claim["claim"], claim["evidence"], claim.get("note", "")]
        words += [test.get(name, "") for test in claim["tests"] for name in ("test", "reason")]
        for text in words:
            assert not re.search(r"(?<!= )(?<![\d.])0?\.\d+(?!\d)(?! %| points)", text), (claim["id"], text)


def test_a_claim_row_says_that_the_other_study_was_not_run(page):
    assert page.text.count("not run") >= 6


def test_every_estimate_of_the_ledger_has_words_and_a_unit():
    for claim in synthetic.ledger():
        for test in claim["tests"]:
            for part in test["rules"]:
                label, unit = entry(f"estimates.{claim['id']}")[part]
                assert label
                assert unit in entry("units")
