"""The reference run in the repository, what the README says of it, and the comparison with another run."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import synthetic
import torch

from reacher_shaping.analysis.agreement import agreement, compare, compare_verdicts, verdicts_agree
from reacher_shaping.analysis.scores import profiles_frame
from reacher_shaping.figures import paper
from reacher_shaping.figures.style import save
from reacher_shaping.report import paper_tables
from reacher_shaping.report.loader import load
from reacher_shaping.report.readme import headline, put_headline
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import ArtifactError, read_table, write_json, write_table, write_text
from reacher_shaping.storage.policy_format import read_policy, weights_checksum, write_policy
from reacher_shaping.storage.reference import (
    POLICIES,
    checksums,
    copy_kept,
    keep_policies,
    keep_tables,
    objections,
    replaced,
)
from reacher_shaping.storage.tables import TABLES, of_study

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "report" / "reference"
MAIN_TABLES = of_study({"main", "claims", "lengths"})
needs_reference = pytest.mark.skipif(not (KEPT / "manifest.json").exists(), reason="no reference run is kept")


def read(name):
    (entry,) = (entry for entry in TABLES.values() if entry.file == name)
    return read_table(KEPT / name, entry.schema)


def published():
    return paper_tables.published_cells(
        *(pd.read_csv(ROOT / f"report/published/table{number}.csv") for number in (2, 3))
    )


def make_runs(shift=0.0, seeds=6, first=0):
    rows = []
    for variant, base in (("none", 0.3), ("l2", 0.25)):
        for seed in range(first, first + seeds):
            rate = base + 0.01 * ((7 * seed) % 5) + (shift if variant == "l2" else 0.0)
            key = {"protocol": "paper", "variant": variant, "budget": 500_000, "alpha0": 1.0, "seed": seed}
            rows.append(key | {"success_rate": rate, "mean_return": -10 - 10 * rate})
    return pd.DataFrame(rows)


@needs_reference
def test_readme_says_what_the_reference_tables_hold():
    record = json.loads((KEPT / "manifest.json").read_text())
    text = headline(load(KEPT, ROOT / "report" / "published"), record, "report/reference/headline.svg")
    assert len(re.sub(r"!\[.*?\]\(.*?\)", "", text).split()) <= 150
    assert put_headline((ROOT / "README.md").read_text(), text) == (ROOT / "README.md").read_text()


@needs_reference
def test_headline_figure_is_drawn_from_the_reference_tables(tmp_path):
    figure = paper.figure_2(read("cells.parquet"), published(), controllers=read("controllers.parquet"))
    save(figure, tmp_path / "figure_2")
    assert (tmp_path / "figure_2.svg").read_text() == (KEPT / "headline.svg").read_text()


@needs_reference
def test_reference_cells_are_the_means_of_its_runs():
    runs, cells = read("runs.parquet"), read("cells.parquet")
    means = runs.groupby(["variant", "budget", "alpha0"])["success_rate"].mean()
    kept = cells.set_index(["variant", "budget", "alpha0"])["success_rate"]
    assert np.allclose(means, kept.loc[means.index], rtol=0, atol=1e-12)
    assert len(cells) == 23
    assert (cells["seeds"] == runs.groupby(["variant", "budget", "alpha0"]).size().iloc[0]).all()


@needs_reference
def test_profiles_kept_are_those_of_the_runs_kept():
    made = profiles_frame(read("runs.parquet"))
    pd.testing.assert_frame_equal(made, read("profiles.parquet"), rtol=1e-12)


@needs_reference
def test_tables_kept_are_those_of_the_run(tmp_path):
    keep_tables(KEPT, tmp_path, MAIN_TABLES)
    for name in MAIN_TABLES:
        assert (tmp_path / TABLES[name].file).exists(), name
    assert read("cells.parquet").equals(read_table(tmp_path / "cells.parquet", schemas.CELLS))


@needs_reference
def test_peers_are_kept_where_the_run_has_them(tmp_path):
    results = tmp_path / "results"
    shutil.copytree(KEPT, results)
    (results / "peers.parquet").unlink(missing_ok=True)
    keep_tables(results, tmp_path / "without", MAIN_TABLES)
    assert not (tmp_path / "without/peers.parquet").exists()
    assert (tmp_path / "without/runs.parquet").exists()
    write_table(results / "peers.parquet", synthetic.peers(), schemas.PEERS)
    keep_tables(results, tmp_path / "with", MAIN_TABLES)
    assert read_table(tmp_path / "with/peers.parquet", schemas.PEERS).equals(synthetic.peers())


@needs_reference
def test_nothing_is_kept_of_a_study_with_a_damaged_table(tmp_path):
    results, kept = tmp_path / "results", tmp_path / "kept"
    shutil.copytree(KEPT / "experiments" / "released", results)
    names = of_study({"further", "claims"})
    keep_tables(results, kept, names)
    assert {path.name for path in kept.iterdir()} == {path.name for path in results.iterdir()}
    assert {path.name for path in kept.iterdir()} >= {entry.file for entry in names.values()}
    (results / "logs.parquet").write_bytes(b"PAR1")
    with pytest.raises(ArtifactError, match=r"logs\.parquet"):
        keep_tables(results, tmp_path / "again", names)
    assert not (tmp_path / "again").exists()


def test_run_that_lacks_a_table_cannot_be_the_reference(tmp_path):
    with pytest.raises(ArtifactError, match=r"runs\.parquet"):
        keep_tables(tmp_path, tmp_path / "kept", MAIN_TABLES)


def test_a_run_agrees_with_itself_and_with_other_seeds_of_the_same_kind():
    assert agreement(compare(make_runs(), make_runs())).startswith("The runs agree: none of 2")
    assert agreement(compare(make_runs(), make_runs(first=100))).startswith("The runs agree")


def test_a_shifted_cell_is_named():
    compared = compare(make_runs(shift=0.2), make_runs(first=3))
    assert "differ beyond seed noise in 1 of 2 cells: paper/l2/500000/1.0" in agreement(compared)
    row = compared[(compared["variant"] == "l2") & (compared["metric"] == "success_rate")].iloc[0]
    assert row["difference"] == pytest.approx(0.2, abs=0.02)
    assert row["ci_low"] < row["difference"] < row["ci_high"]


def test_one_seed_cannot_tell():
    assert agreement(compare(make_runs(seeds=1), make_runs())).startswith("Cannot tell")


def test_headline_goes_between_its_marks_and_needs_them():
    readme = "a\n<!-- reference: begin -->\nold\n<!-- reference: end -->\nb\n"
    assert put_headline(readme, "new \\1\n") == readme.replace("old", "new \\1")
    with pytest.raises(ValueError, match="marks"):
        put_headline("no marks", "new")


def test_verdicts_of_two_studies_stand_side_by_side():
    ids = ["C1", "C2", "C3", "C4"]
    ours = pd.DataFrame({"id": ids, "interval_verdict": ["reproduced", "inconclusive", "untestable", "not reproduced"]})
    other = ["reproduced", "reproduced", "reproduced", "not reproduced"]
    reference = pd.DataFrame({"id": ids, "interval_verdict": other, "replication": [0.9, 0.4, 1.0, 0.9]})
    compared = compare_verdicts(ours.assign(replication=0.5), reference)
    assert compared["same"].to_list() == [True, False, True]
    assert verdicts_agree(compared) == "Of 3 verdicts 2 are the same, 2.2 were to be expected. Others: C2."
    assert verdicts_agree(compared.head(0)) == "No claim is tested in both."


def shown(folder, **values):
    """The policies that a report shows, of one run each whose weights are all of a value, with what is told of them."""
    summary: dict[str, dict] = {"controller": {"gains": [1.0, 0.1, 3.0]}}
    for name, value in values.items():
        weights = {"log_std": torch.full((1, 2), float(value))}
        write_policy(folder / POLICIES / f"{name}.pt", [4], weights, {})
        told = {"cell": f"paper-{name}", "seed": 4, "git": {"commit": "c" * 40, "dirty": False}, "code": "d"}
        summary[name] = told | {"weights": weights_checksum(weights)}
    write_json(folder / POLICIES / "policies.json", summary)
    return folder


def test_policies_are_kept_with_seed_commit_and_checksum_and_those_of_before_stay(tmp_path):
    before, results = shown(tmp_path / "before", none=0, tuned=1), shown(tmp_path / "results", none=2)
    keep_policies(results, tmp_path / "kept", before)
    summary = json.loads((tmp_path / "kept" / POLICIES / "policies.json").read_text())
    assert set(summary) == {"controller", "none", "tuned"}
    for name, value in (("none", 2), ("tuned", 1)):
        kept = read_policy(tmp_path / "kept" / POLICIES / f"{name}.pt")
        assert kept.weights["log_std"].tolist() == [[value, value]]
        assert summary[name]["seed"] == kept.seeds[0] == 4
        assert summary[name]["weights"] == weights_checksum(kept.weights)
        assert summary[name]["git"] == {"commit": "c" * 40, "dirty": False}


@pytest.mark.parametrize("changed", ["before", "results"])
def test_a_policy_that_is_not_the_one_told_of_is_refused_and_nothing_is_kept(tmp_path, changed):
    folders = {name: shown(tmp_path / name, none=0, tuned=1) for name in ("before", "results")}
    write_policy(folders[changed] / POLICIES / "tuned.pt", [4], {"log_std": torch.full((1, 2), 7.0)}, {})
    with pytest.raises(ArtifactError, match=r"tuned\.pt: is not the policy that"):
        keep_policies(folders["results"], tmp_path / "kept", folders["before"])
    assert not (tmp_path / "kept").exists()


@needs_reference
def test_each_kept_policy_tells_its_run_and_commit_and_is_the_one_told_of():
    summary = json.loads((KEPT / POLICIES / "policies.json").read_text())
    files = {path.stem for path in (KEPT / POLICIES).glob("*.pt")}
    assert files == {name for name, told in summary.items() if "weights" in told}
    for name in files:
        told, kept = summary[name], read_policy(KEPT / POLICIES / f"{name}.pt")
        assert told["weights"] == weights_checksum(kept.weights)
        assert kept.seeds == [told["seed"]]
        if name != "untrained":
            assert re.fullmatch(r"[0-9a-f]{40}", told["git"]["commit"])
            assert re.fullmatch(r"[0-9a-f]{64}", told["code"])


@needs_reference
def test_report_to_read_is_that_of_the_reference_run():
    record = json.loads((KEPT / "manifest.json").read_text())
    commit = record["blocks"][0]["git"]["commit"][:12]
    page, paper = ((KEPT.parent / "site" / name).read_bytes() for name in ("index.html", "report.pdf"))
    for words in (f"code {commit}", f"settings {record['settings_hash'][:12]}"):
        assert words in page.decode()
        assert words.encode() in paper, "the PDF's keywords"
    assert b'href="notebooks/' not in page, "no notebook lies beside it"


CHOSEN = "tasks.reacher:TASK, training.potentials:l2"


def kept_folder(folder, *, runs=2, files=("runs.parquet",), dirty=False, codes=("a", "a")):
    """A reference run of two blocks of one cell, of empty tables."""
    for name in files:
        write_text(folder / name, name)
    cell = {"protocol": "paper", "variant": "l2", "budget": 1, "alpha0": 1.0}
    blocks = [
        {
            "cell": cell,
            "task": "reacher",
            "chosen": CHOSEN.split(", "),
            "seeds": list(range(runs)),
            "code": code,
            "git": {"commit": "c", "dirty": dirty},
        }
        for code in codes
    ]
    write_json(folder / "manifest.json", {"blocks": blocks, "experiments": {}, "peers": []})
    return folder


def test_run_that_loses_nothing_and_is_traced_may_be_the_reference(tmp_path):
    kept, new = kept_folder(tmp_path / "kept"), kept_folder(tmp_path / "new", runs=3)
    assert objections(kept, new) == []
    assert objections(tmp_path / "none", new) == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"runs": 1}, "it has 2 runs of the main study, the one that is kept 4"),
        ({"files": ()}, "it lacks 1 files of the one that is kept, such as runs.parquet"),
        ({"dirty": True}, "2 of its 2 blocks were not trained from a clean commit"),
        ({"dirty": None}, "2 of its 2 blocks were not trained from a clean commit"),
        ({"codes": ("a", "b")}, f"its blocks with {CHOSEN} were trained by 2 different codes"),
    ],
)
def test_what_a_new_reference_would_lose_or_cannot_tell_is_said(tmp_path, changes, said):
    assert objections(kept_folder(tmp_path / "kept"), kept_folder(tmp_path / "new", **changes)) == [said]


def test_another_potential_is_other_code_and_nothing_against_it(tmp_path):
    """A protocol may have a potential of its own for all decays: one variant, two potentials."""
    new = kept_folder(tmp_path / "new", codes=("a", "b"))
    record = json.loads((new / "manifest.json").read_text())
    record["blocks"][1]["chosen"] = ["tasks.reacher:TASK", "training.potentials:l2sq"]
    write_json(new / "manifest.json", record)
    assert objections(tmp_path / "none", new) == []


def test_a_study_that_stays_as_it_was_kept_is_not_judged_again(tmp_path):
    """Its blocks tell no cell and came from other code; those made now are judged all the same."""
    kept, new = (kept_folder(tmp_path / name) for name in ("kept", "new"))
    earlier = {"mine": [{"code": "old", "git": {"commit": "c", "dirty": True}}]}
    for folder in (kept, new):
        record = json.loads((folder / "manifest.json").read_text())
        write_json(folder / "manifest.json", record | {"experiments": earlier})
    assert objections(kept, new) == []
    record["experiments"] = {"mine": [record["blocks"][0] | {"code": "other"}]}
    write_json(new / "manifest.json", record)
    assert objections(kept, new) == [f"its blocks with {CHOSEN} were trained by 2 different codes"]


def test_a_kept_study_goes_over_as_it_was_or_not_at_all(tmp_path):
    kept = kept_folder(tmp_path / "kept", files=("experiments/mine/runs.parquet", "runs.parquet"))
    record = json.loads((kept / "manifest.json").read_text())
    write_json(kept / "manifest.json", record | {"tables": checksums(kept)})
    copy_kept(kept, tmp_path / "new", "experiments/mine/")
    assert [path.name for path in (tmp_path / "new").rglob("*.parquet")] == ["runs.parquet"]
    write_text(kept / "experiments/mine/runs.parquet", "edited")
    with pytest.raises(
        ArtifactError, match=r"mine/runs\.parquet: is not the file that the reference run was kept with"
    ):
        copy_kept(kept, tmp_path / "again", "experiments/mine/")


def test_folder_is_replaced_whole_or_not_at_all(tmp_path):
    kept = kept_folder(tmp_path / "kept", files=("a", "b"))
    before = checksums(kept)
    with pytest.raises(ZeroDivisionError), replaced(kept) as new:
        write_text(new / "a", f"half of the new {1 / 0}")
    assert checksums(kept) == before
    kept.rename(tmp_path / ".kept.old")  # as a process does that is killed between two renames
    with pytest.raises(ZeroDivisionError), replaced(kept) as new:
        write_text(new / "a", f"half of the new {1 / 0}")
    assert checksums(kept) == before
    with replaced(kept) as new:
        write_text(new / "c", "new")
    assert checksums(kept).keys() == {"c"}
    assert [path.name for path in tmp_path.iterdir() if path.name != "kept"] == []


@needs_reference
def test_kept_files_are_those_that_the_manifest_has_the_checksums_of():
    record = json.loads((KEPT / "manifest.json").read_text())
    if "tables" not in record:
        pytest.skip("kept before a manifest told checksums")
    assert record["tables"] == checksums(KEPT)
