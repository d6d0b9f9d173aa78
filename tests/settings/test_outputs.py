"""A further study has the figures that its cells can fill."""

from pathlib import Path

import pytest
import yaml

from reacher_shaping.settings.base import ConfigError
from reacher_shaping.settings.outputs import MAIN_VIEWS, judged, ledgers, tables_of, views
from reacher_shaping.settings.study import load_study, read_settings

LEDGERS = ledgers(yaml.safe_load((Path(__file__).parents[2] / "report/hypotheses.yaml").read_text()))


def keys(*cells):
    return [dict(zip(("protocol", "variant", "alpha0"), cell, strict=True)) for cell in cells]


@pytest.mark.parametrize(
    ("cells", "switches", "expected"),
    [
        (keys(("paper", "none", 1.0)), False, ["cells", "log"]),
        (keys(("paper", "none", 1.0), ("released_late_without_d1", "none", 1.0)), True, ["cells", "effects"]),
        (keys(("released", "none", 1.0), ("released", "l2", 3.0)), False, ["cells", "log"]),
        (keys(("late", "none", 1.0), ("late", "none", 0.5)), False, ["cells", "log", "correlation"]),
        (keys(*(("standard", name, 1.0) for name in ("none", "l2", "l2sq"))), False, ["cells", "log", "forest"]),
        (keys(*(("standard", name, 1.0) for name in ("l2sq", "l2", "decay"))), False, ["cells", "log"]),
    ],
)
def test_views_follow_from_the_cells(cells, switches, expected):
    assert views("mine", cells, {"effects"} if switches else {}) == expected


def test_the_studies_of_the_configuration_have_theirs():
    study = load_study(read_settings("config.yaml"))
    found = {
        name: views(name, [cell.key for cell in study.cells_of[name]], tables_of(study, name, {"sparse"}))
        for name in study.studies
    }
    expected = {
        "released": ["cells", "log", "correlation", "forest"],
        "attribution": ["cells", "effects"],
        "standard": ["cells", "log", "forest"],
        "tuned": ["cells", "log"],
        "sparse": ["cells", "dose", "takeoff", "targets", "log", "forest"],
        "weights": ["cells", "log", "forest"],
        "tasks": ["cells", "log", "forest"],
        "long": ["cells", "log"],
        "ablation": ["cells", "effects"],
        "main": list(MAIN_VIEWS[:-1]),  # without other algorithms, which nobody has asked for
    }
    assert {name: found[name] for name in expected} == expected


def test_a_study_has_the_tables_that_it_asks_for():
    study = load_study(read_settings("config.yaml"))
    tables = {name: tables_of(study, name, LEDGERS) for name in study.studies}

    def having(table):
        return {name for name, own in tables.items() if table in own}

    assert having("hypotheses") == set(LEDGERS) == {"sparse", "weights", "ceiling"}
    assert having("takeoff") == having("targets") == having("hypotheses")
    assert "targets" not in tables_of(study, "tasks", {"tasks"}), "no targets in Reacher's plane"
    assert having("lengths") == having("long_episodes") == {"main", "long"}
    assert having("effects") == {"attribution", "ablation"}
    assert having("agreement") == {"standard"}
    assert having("logs") == set(study.experiments)
    assert having("lottery") == having("sensitivity") == {"main"}
    assert having("runs") == having("comparisons") == having("correlation") == set(study.studies)
    assert not having("peers"), "of the main study, an input only once they were asked for"


def test_a_second_ledger_of_a_study_is_refused():
    assert ledgers([{"study": "a"}, {"study": "b"}]).keys() == {"a", "b"}
    with pytest.raises(ConfigError, match=r"hypotheses.yaml: study 'a' has two entries; allowed: one"):
        ledgers([{"study": "a"}, {"study": "a"}])


def test_claims_are_judged_where_the_papers_cells_are_and_no_two_protocols_have_the_same():
    study = load_study(read_settings("config.yaml"))
    found = {name for name in study.studies if judged(study.design(name))}
    assert found == {"main", "released", "standard"}
    cell = {"variant": "l2", "budget": 1, "alpha0": 1.0}
    assert judged([cell | {"group": "main"}, cell | {"group": "extra"}, cell | {"group": "extra"}])
    assert not judged([cell | {"group": "main"}, cell | {"group": "appendix"}])
    assert not judged([cell | {"group": "extra"}])
    assert {name for name in study.studies if "claims" in tables_of(study, name, {})} == found
