"""The paper of the study says what the page says, in its order, with what its words and tables take."""

import dataclasses

import pytest
import report_inputs
import synthetic

from reacher_shaping.report import pdf
from reacher_shaping.settings.study import load_study


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    study = load_study(report_inputs.ROOT / "config.yaml").model_dump(mode="json")
    return report_inputs.make(tmp_path_factory.mktemp("study"), study, synthetic.PAPER_GRID, 3)


def parts(inputs, kind):
    return [part for section in pdf.contents(inputs)["sections"] for part in section["parts"] if part["kind"] == kind]


def test_same_study_gives_the_same_bytes(inputs):
    made = pdf.build(inputs)
    assert made.startswith(b"%PDF")
    assert made == pdf.build(inputs)


def test_header_names_study_code_settings_and_that_no_day_is_recorded(inputs):
    facts = pdf.contents(inputs)["facts"]
    for words in (
        "study paper",
        "69 training runs",
        "code 0123456789ab",
        "settings abab",
        "day of training not recorded",
    ):
        assert words in facts
    dated = [inputs.manifests[0] | {"finished": day} for day in ("2026-11-24T10:00", "2026-11-22T10:00")]
    assert "trained 2026-11-22 to 2026-11-24" in pdf.contents(dataclasses.replace(inputs, manifests=dated))["facts"]


def test_tables_that_the_text_speaks_of_are_there_and_its_words_are_explained(inputs):
    assert "Runs per cell" in [part["caption"] for part in parts(inputs, "table")]
    explained = " ".join(item for part in parts(inputs, "list") for item in part["items"])
    for word in ("Holm", "Welch", "SAC, TD3", "IQM", "inverse kinematics + PD", "points"):
        assert f"#emph[{word}" in explained or f"{word}]" in explained, word


def test_toy_study_says_so_first(inputs, tmp_path):
    toy = report_inputs.make(tmp_path, inputs.settings, synthetic.TOY_GRID, 2, only=("cells", "runs"), figures={})
    assert pdf.contents(toy)["toy"].startswith("A toy run: 4,096 environment steps")
    assert pdf.contents(inputs)["toy"] == ""
    assert pdf.build(toy).startswith(b"%PDF")
