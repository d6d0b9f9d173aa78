"""The further studies' figures and their section of the report show the numbers of their tables."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import switched
import synthetic
from switched import LOGS, peers

from reacher_shaping.analysis.baselines import agreement_frame
from reacher_shaping.figures.studies import switch_label
from reacher_shaping.labels import number
from reacher_shaping.report import paper_tables, study_sections, study_tables
from reacher_shaping.report.loader import Study
from reacher_shaping.storage.reference import read_tables

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def effects():
    return switched.effects()


@pytest.fixture(scope="module")
def released():
    return switched.released()


@pytest.fixture(scope="module")
def section(released):
    return study_sections.section("released", released, LOGS, synthetic.correlation())


def test_section_tells_the_correlation_beside_the_published_one(section):
    row = section.grids[next(name for name in section.grids if name.startswith("Pearson"))].rows[0]
    assert row[0] == "r(α₀, return)"
    assert row[1] == "0.91"  # one seed a cell has no interval
    said = " ".join(section.sentences)
    assert row[1] in said
    assert row[2] in said
    assert row[-1].startswith("0.91 [")  # of the main study, made up
    assert section.figures == ["released_cells", "released_log", "released_correlation", "released_forest"]


def test_section_sets_every_published_run_beside_ours(released):
    names = ("table2.csv", "table3.csv", "left_out.csv")
    published = paper_tables.published_cells(*(pd.read_csv(synthetic.PUBLISHED / name) for name in names))
    assert len(published) == 24
    section = study_sections.section("released", released, LOGS, published=published)
    grid = section.grids[next(name for name in section.grids if name.startswith("Every published run"))]
    rows = {row[0]: [entry.replace("\N{MINUS SIGN}", "-") for entry in row[1:]] for row in grid.rows}
    assert len(rows) == len(released["cells"]) == 8
    left_out = rows["none_500K_alpha_5"]
    assert left_out[:3] == ["none", "500K, α₀ = 0.5", "29.6"]
    assert left_out[4] == "-284.51"
    cells = released["cells"].set_index(["variant", "budget", "alpha0"])
    for place, metric in ((3, "success_rate"), (5, "mean_return")):
        ours = cells.loc[("none", 500_000, 0.5)]
        digits, factor = (1, 100) if metric == "success_rate" else (2, 1)
        numbers = [factor * ours[f"{metric}{end}"] for end in ("", "_low", "_high")]
        assert left_out[place] == "{} [{}, {}]".format(*(f"{value:.{digits}f}" for value in numbers))


def test_section_lists_our_logs_and_then_the_published_one(section):
    grid = section.grids[next(name for name in section.grids if "own log" in name)]
    rows = [[entry.replace("\N{MINUS SIGN}", "-") for entry in row] for row in grid.rows]
    assert rows[0][:4] == ["released", "none", "500K, α₀ = 1", "31 [30, 32]"]
    assert rows[0][4:] == ["-41.0 [-42.0, -40.0]", "-90.0 [-90.0, -90.0]", "0.45 [0.45, 0.45]"]
    assert rows[-1] == ["published, none_seed0", "none", "500K", "33", "-38.6", "-87.2", "0.40 and 0.54"]
    assert len(rows) == 8 + 1


def test_caption_of_logs_promises_published_runs_only_where_they_are(released):
    sections = (study_sections.section("mine", released, logs) for logs in (LOGS, LOGS.assign(protocol="other")))
    told = [next(name for name in each.grids if "own log" in name) for each in sections]
    assert [text.endswith("Below, published runs of the same cells") for text in told] == [True, False]


def test_section_of_switches_names_the_largest_effect_and_the_interactions(released, effects):
    given = {**released, "effects": effects}
    text = " ".join(study_sections.section("attribution", given, LOGS).sentences)
    assert (
        "success at any step: a: epochs 10 to 5 (none, as the last one, to the end), 20.0 [20.0, 20.0] points" in text
    )
    assert "depends on the others beyond chance for a (success" in text
    weak = effects.assign(p_holm=0.06)
    assert "No switch's effect depends on the others beyond chance." in study_sections.effects_sentence(weak)


def test_the_largest_effect_may_be_a_loss(effects):
    first = (effects["effect"] == "alone") & (effects["switch"] == "b") & (effects["metric"] == "success_rate")
    moved = effects.assign(difference=np.where(first, -0.7, effects["difference"]))
    assert "success at any step: b: discount 0.99 to 0.5 (none, alone" in study_sections.effects_sentence(moved)


def test_best_cell_is_the_one_with_the_highest_success(released):
    cells = released["cells"].assign(success_rate=0.1)
    cells.loc[(cells["variant"] == "l2sq"), "success_rate"] = 0.9
    text = study_sections.best_sentence(cells)
    assert text.startswith("The cell with the highest success rate is released late, L2² (500K, α₀ = 0.5): success")
    assert "any step 90.0" in text


def test_one_seed_a_cell_ranges_over_the_studies_of_one_seed(section, released):
    own = released["correlation"][released["correlation"]["method"] == "pearson"]
    own = own[own["level"].isin(["seed0", "seed1", "seed2"])].groupby(["x", "y"])["r"].agg(["min", "max"])
    rows = section.grids[next(name for name in section.grids if name.startswith("Pearson"))].rows
    for row, pair in zip(rows, study_tables.PAIRS, strict=True):
        span = row[4].replace("\N{MINUS SIGN}", "-")
        assert span == "{min:.2f} to {max:.2f}".format(**own.loc[pair])


def test_section_says_whether_a_peer_differs(released):
    ours = synthetic.runs([("standard", "none", 500_000, 1.0)], 8)
    same = study_sections.agreement_sentence(agreement_frame(ours, peers()))
    assert same.startswith("None of 8 measures differs from Stable-Baselines3's beyond chance (8 seeds beside 5); the")
    frame = agreement_frame(ours, peers())
    low, high = (f"{100 * frame[name].iloc[0]:.1f}".replace("-", "\N{MINUS SIGN}") for name in ("ci_low", "ci_high"))
    assert same.endswith(f" [{low}, {high}] points.")
    apart = study_sections.agreement_sentence(agreement_frame(ours, peers(0.5)))
    assert apart.startswith("1 of 8 measures differ")
    assert apart.endswith("success at any step.")
    assert "to its PPO in success at any step is" in same
    alone = agreement_frame(ours, peers(seeds=1))
    assert study_sections.agreement_sentence(alone).endswith("cannot be told (8 seeds beside 1).")
    uncorrected = agreement_frame(ours, peers()).assign(p=1e-9)
    assert study_sections.agreement_sentence(uncorrected) == same


def test_section_counts_the_differences_that_survive_holm(released):
    shaped = released["comparisons"][released["comparisons"]["family"] == "none"].copy()
    shaped["p_holm"] = np.where(shaped["metric"] == "final_distance", 0.01, 0.5)
    shaped.loc[shaped["metric"] == "final_distance", "difference"] = -0.01
    alone = study_sections.shaping_sentence(shaped.assign(p=np.nan, p_holm=np.nan))
    assert alone == "With one seed no difference between shaped cells and none can be told from chance."
    text = study_sections.shaping_sentence(shaped)
    assert "distance at the last step in 5 of 5 (5 for the better)" in text
    assert "success at any step in 0 of 5," in text


def test_section_corrects_over_the_measures_of_the_only_shaped_cell(released):
    shaped = released["comparisons"]
    shaped = shaped[shaped["family"] == "none"].groupby("metric").head(1)
    shaped = shaped.assign(seeds=10, p=0.5, p_holm=0.001, difference=-0.01, ci_low=-0.02, ci_high=0.01)
    nothing = study_sections.shaping_sentence(shaped)
    assert "(Holm over the measures, 5 %): nothing. Not to be told from chance: success at any step" in nothing
    shaped.loc[shaped["metric"] == "final_distance", "p"] = 0.009  # 5 times as much once corrected: below 5 %
    shaped.loc[shaped["metric"] == "mean_return", "p"] = 0.015  # 4 times as much: above
    changed, chance = study_sections.shaping_sentence(shaped).split("Not to be told from chance")
    minus = "\N{MINUS SIGN}"
    assert f"5 %): distance at the last step {minus}10.0 [{minus}20.0, 10.0] mm, p 0.045." in changed
    assert f"mean return {minus}0.01 [{minus}0.02, 0.01], p 0.060" in chance
    assert "success" not in changed
    section = study_sections.section("tuned", {**released, "comparisons": shaped}, LOGS)
    rows = section.grids[next(name for name in section.grids if name.endswith("Holm-corrected over a row"))].rows
    assert [row[3:][1::2] for row in rows] == [["1.000", "1.000", "0.060", "0.045", "1.000"]], "as in the sentence"


def test_two_protocols_of_one_shaped_cell_are_no_only_cell(released):
    shaped = released["comparisons"]
    shaped = shaped[shaped["family"] == "none"].groupby(["protocol", "metric"]).head(1)
    assert shaped["protocol"].nunique() == 2
    losses = np.where(shaped["protocol"] == "released", 0.1, -0.1)
    text = study_sections.shaping_sentence(shaped.assign(seeds=10, p_holm=0.01, difference=losses))
    assert "success at any step in 2 of 2 (1 for the better)" in text


def test_document_holds_every_table_and_figure(released):
    controllers = synthetic.controllers().assign(protocol="released", mode="stochastic", final_success_rate=1.0)
    curve = {"protocol": "released", "variant": "none", "alpha0": 1.0, "budget": 500_000, "episode_return": -50.0}
    logged = pd.DataFrame({"iteration": [1, 2], **curve})
    given = {"released": {**released, "controllers": controllers, "logged": logged}}
    text = study_sections.document(given, LOGS)
    assert text.startswith("## Released")
    assert text.count("<img ") == 4
    assert text.count("| --: |") >= 4
    assert study_sections.document({}, LOGS) == ""


def test_unknown_experiment_has_a_section_too(released):
    section = study_sections.section("my_study", released, LOGS)
    assert (section.title, section.intro) == ("My study", "")
    assert section.grids


def test_switch_that_is_named_as_its_setting_is_said_once():
    row = {"switch": "discount", "setting": "discount 0.99 to 0.954"}
    assert switch_label(row) == "discount 0.99 to 0.954"
    assert switch_label(row | {"switch": "d1"}) == "D1: discount 0.99 to 0.954"


def test_nothing_is_shown_without_a_minus_sign():
    assert (number(-0.04, 1), number(-0.06, 1), number(0.0, 2)) == ("0.0", "\N{MINUS SIGN}0.1", "0.00")


def test_question_of_a_study_ends_as_a_sentence(released):
    for question, told in (("What", "What."), ("Why?", "Why?"), ("So.", "So."), ("", "")):
        assert study_sections.section("mine", released, LOGS, words={"question": question}).intro == told


def test_a_figure_belongs_to_the_study_that_draws_it_whatever_its_name(released):
    """The main study has a figure `long_episodes`, which a study called `long` does not take."""
    published = synthetic.published()
    study = Study({"cells": released["cells"]}, {"long": released}, published, published, LOGS)
    figures = study_sections.figures_of(study)
    assert figures["long_episodes"] == ("main", "long_episodes")
    assert figures["long_cells"] == ("long", "cells")
    assert "peers" not in figures


def test_hypotheses_are_told_with_both_cells_and_counted_by_verdict():
    row = {"id": "S1", "claim": "c", "a": "p l2 50", "b": "p none 1", "mean_a": 0.5, "mean_b": 0.01, "difference": 0.49}
    row |= {"ci_low": 0.3, "ci_high": 0.6, "p_holm": 0.009, "solved_a": 0.8, "solved_b": 0.0, "verdict": "supported"}
    row |= {"runs": 10.0, "least_a": 0.02, "greatest_a": 0.6}
    table = pd.DataFrame([row, row | {"id": "S2", "verdict": "open"}])
    grid = study_tables.hypotheses(table)
    assert len(grid.headings) == len(grid.rows[0])
    assert grid.rows[0][2:5] == ["p, L2, α₀ = 50: 50.0 %", "p, none: 1.0 %", "49.0 [30.0, 60.0]"]
    assert grid.rows[0][6] == "8 and 0 of 10"
    assert [row[-1] for row in grid.rows] == ["supported", "open"]
    counted, opened, told = study_sections.hypotheses_sentences(table)
    assert counted == ("Of 2 hypotheses written down before the runs, 1 are supported, 0 contradicted and 1 stay open.")
    assert "none is excluded" in opened
    assert told.startswith("“c” is supported")
    *_, same = study_sections.hypotheses_sentences(table.iloc[::-1])
    assert same == told, "what is decided is told, wherever it stands"
    assert "differs by 49.0 [30.0, 60.0] points (p 0.009 " in told
    assert "8 of 10 runs solve the task with p, L2, α₀ = 50, 0 with p, none." in told
    assert "between 2.0 and 60.0 %" in told
    decided = study_sections.hypotheses_sentences(table.assign(verdict="supported"))
    assert not [text for text in decided if "none is excluded" in text]


def test_a_study_with_hypotheses_tells_them_and_their_table_first():
    folder = ROOT / "report/sparse_run"
    given = read_tables(folder)
    section = study_sections.section("sparse", given, LOGS)
    assert section.sentences[0].startswith("Of 9 hypotheses written down before the runs, 0 are supported, 0 contra")
    assert section.sentences[3].startswith("Beside the hypotheses"), "what nobody predicted comes after, and says so"
    (grid,) = section.first.values()
    assert [row[0] for row in grid.rows] == [f"S{number}" for number in range(1, 10)]
    assert {row[-1] for row in grid.rows} == {"open"}
    assert section.figures == [f"sparse_{view}" for view in ("cells", "dose", "takeoff", "targets", "log", "forest")]


def test_lengths_have_a_row_per_cell_and_length_with_every_interval():
    row = {
        "protocol": "tuned",
        "variant": "none",
        "budget": 1_000_000,
        "alpha0": 1.0,
        "mode": "stochastic",
        "steps": 500,
    }
    for name in ("success_rate", "final_success_rate", "share_within_radius", "final_distance"):
        row |= {name: 0.5, f"{name}_low": 0.4, f"{name}_high": 0.6}
    (shown,) = (grid := study_tables.lengths(pd.DataFrame([row]))).rows
    assert len(grid.headings) == len(shown)
    assert shown[3:5] == ["500", "50.0 [40.0, 60.0]"]
    other = row | {"protocol": "tuned_terminal", "final_success_rate": 0.7}
    told = study_sections.lengths_sentence(pd.DataFrame([row, other, row | {"steps": 50, "final_success_rate": 0.9}]))
    assert told == (
        "At the end of episodes of 500 steps the tip is on the target in: 70.0 [40.0, 60.0] % with tuned "
        "terminal, none; 50.0 [40.0, 60.0] % with tuned, none."
    )
