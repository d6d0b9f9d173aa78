"""A further study has the figures that its cells can fill."""

import pytest

from reacher_shaping.settings.outputs import files_of, judged, table_files, views
from reacher_shaping.settings.study import load_study, read_settings


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
    assert views(cells, {"effects"} if switches else {}) == expected


def test_the_studies_of_the_configuration_have_theirs():
    study = load_study(read_settings("config.yaml"))
    found = {
        name: views(
            [cell.key for cell in cells], {file.partition(".")[0] for file in files_of(study, name, {"sparse"})}
        )
        for name, cells in study.experiment_cells.items()
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
    }
    assert {name: found[name] for name in expected} == expected


def test_a_study_has_the_tables_that_it_asks_for():
    study = load_study(read_settings("config.yaml"))
    files = {name: set(files_of(study, name, {"sparse"})) for name in study.experiments}

    def having(file):
        return {name for name, own in files.items() if file in own}

    assert having("hypotheses.csv") == having("takeoff.parquet") == having("targets.parquet") == {"sparse"}
    assert "targets.parquet" not in files_of(study, "tasks", {"tasks"}), "no targets in Reacher's plane"
    assert having("lengths.parquet") == {"long"}
    assert having("effects.csv") == {"attribution", "ablation"}
    assert having("agreement.csv") == {"standard"}
    assert having("runs.parquet") == set(files)


def test_claims_are_judged_where_no_two_protocols_have_the_same_cell():
    study = load_study(read_settings("config.yaml"))
    found = {name for name, cells in study.experiment_cells.items() if judged(cell.key for cell in cells)}
    assert {"released", "standard", "tuned"} <= found
    assert not found & {"attribution", "ablation", "sparse"}
    files = table_files(switches=False, peers=False, claims=True)
    assert {"claims.csv", "claim_parts.csv"} <= set(files)
    assert "claims.csv" not in table_files(switches=False, peers=False, claims=False)
