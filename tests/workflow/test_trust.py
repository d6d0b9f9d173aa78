"""A result is believed for what it says: settings, seeds and checksums, on the real workflow at toy scale."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from project import ROOT, Project

from reacher_shaping.storage.files import read_json, seal_of, sha256, write_json
from reacher_shaping.storage.reference import checksums

NONE, DECAY = "results/paper/none/2048/alpha1/seeds0-0", "results/paper/decay200k_l2sq/2048/alpha0.5/seeds0-0"
SHOWN = ["--allowed-rules", "build_report", "build_crate", "--", "report/report.html", "ro-crate-metadata.json"]


def refusal(project: Project, *arguments: str) -> str:
    """The one line with which a call of Snakemake ends."""
    done = project.snakemake(*arguments)
    assert done.returncode != 0, done.stderr[-3000:]
    lines = [line for line in done.stderr.splitlines() if "ArtifactError" in line]
    assert len(lines) == 1, done.stderr[-3000:]
    return lines[0]


def faster(settings: dict) -> dict:
    """The grid with another learning rate for `none`."""
    first, *others = settings["grid"]
    return {"grid": [first | {"ppo": {"learning_rate": 0.01}}, *others]}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (faster, "ppo.learning_rate = 0.0003, where 0.01 is asked for"),
        ({"evaluation": {"episodes": 20, "radius": 0.05}}, "settings.radius = 0.02, where 0.05 is asked for"),
        ({"evaluation": {"episodes": 30, "radius": 0.02}}, "evaluation.settings.episodes = 20, where 30 is asked"),
        ({"root_seed": 5}, "root_seed"),
    ],
    ids=["learning rate", "radius", "episodes", "root seed"],
)
def test_report_of_runs_with_other_settings_than_the_configs_is_refused(copy, toy_settings, changes, said):
    with copy.configured(**(changes(toy_settings) if callable(changes) else changes)):
        line = refusal(copy, *SHOWN)
    assert f"{NONE}/manifest.json: tells of" in line
    assert said in line


def test_copy_without_snakemakes_records_is_never_shown_with_other_settings(copy, toy_settings):
    shutil.rmtree(copy.folder / ".snakemake")
    assert copy.planned() == {}
    with copy.configured(**faster(toy_settings)):
        done = copy.snakemake()
        assert done.returncode != 0
        assert f"{NONE}/training.json: tells of settings.cell.protocol.ppo.learning_rate = 0.0003" in done.stderr
        assert "Traceback" not in done.stderr
        shutil.rmtree(copy.folder / "results/paper")
        assert len(copy.planned()["train_block"]) == 4 * 4, "deleted as told, they are trained"


READERS = {
    "build_crate": "ro-crate-metadata.json",
    "build_report": "report/report.html",
    "summarise_radii": "results/radii.parquet",
    "aggregate_runs": "results/runs.parquet",
    "render_media": "results/media/paper-none-2048-alpha1.gif",
    "evaluate_long": f"{NONE}/long_episodes.parquet",
    "evaluate_block": f"{NONE}/episodes.parquet",
}
"""Jobs that read blocks, each with one of its files; from the end on, as a failed job's files are deleted."""


def exchange(project: Project, one: str, other: str) -> None:
    first, second, aside = (project.folder / folder for folder in (one, other, "aside"))
    first.rename(aside), second.rename(first), aside.rename(second)


def test_exchanged_blocks_are_refused_wherever_they_are_read(copy):
    exchange(copy, NONE, DECAY)
    for rule, target in READERS.items():
        line = refusal(copy, "--forcerun", rule, "--allowed-rules", rule, "--", target)
        assert f"{NONE}/" in line
        assert "tells of settings.cell.alpha0 = 0.5, where 1.0 is asked for" in line, rule


def test_exchanged_seeds_are_refused(copy):
    exchange(copy, NONE, NONE.replace("seeds0-0", "seeds1-1"))
    line = refusal(
        copy, "--forcerun", "aggregate_runs", "--allowed-rules", "aggregate_runs", "--", "results/runs.parquet"
    )
    assert f"{NONE}/manifest.json: tells of seeds = [1], where [0] is asked for" in line


EDITED = [
    "figures/figure_2.svg",
    "results/notebooks/story.ipynb",
    f"{DECAY}/monitor/0.monitor.csv",
    "figures/forest.pdf",
    "results/tables/table_2.md",
    "results/media/paper-decay200k_l2sq-2048-alpha0.5.mp4",
    f"{DECAY}/long_episodes.parquet",
    f"{DECAY}/manifest.json",
]


def edit(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:-2] + bytes([content[-2] ^ 1]) + content[-1:])


def test_edits_by_hand_are_named_without_a_crate_too(copy):
    for name in EDITED:
        edit(copy.folder / name)
    (copy.folder / "ro-crate-metadata.json").unlink()
    named = copy.python("workflow/verify.py")
    assert named.returncode == 1
    said = set(named.stdout.splitlines())
    assert said >= {f"{name}: has changed since it was made; delete it and run snakemake again" for name in EDITED[:-1]}
    assert any(line.startswith(f"{EDITED[-1]}: ") for line in said)


@pytest.mark.parametrize("name", EDITED[:3])
def test_edit_by_hand_gets_into_no_crate(copy, name):
    edit(copy.folder / name)
    crate = copy.folder / "ro-crate-metadata.json"
    before = crate.read_bytes()
    done = copy.snakemake("--forcerun", "build_crate", *SHOWN)
    assert done.returncode != 0
    assert f"{name}: has changed since it was" in done.stderr
    assert not crate.exists() or crate.read_bytes() == before, "the old one names the edit"


def test_every_file_of_the_crate_has_its_makers_checksum(toy_study):
    listed = [entity["@id"] for entity in read_json(toy_study.folder / "ro-crate-metadata.json")["@graph"]
              if entity["@type"] == "File"]  # fmt: skip
    blocks = {
        path.parent: read_json(path)["outputs"] for path in toy_study.folder.glob("results/*/*/*/*/*/manifest.json")
    }
    inside = {str((folder / name).relative_to(toy_study.folder)) for folder, names in blocks.items() for name in names}
    for name in listed:
        seal = seal_of(toy_study.folder / name)
        assert name in inside or seal.read_text().strip() == sha256(toy_study.folder / name), name


def test_unpacked_archive_still_knows_what_its_files_were(toy_study, tmp_path):
    done = toy_study.python("workflow/archive.py", ".", str(tmp_path / "study.zip"))
    assert done.returncode == 0, done.stderr
    shutil.unpack_archive(tmp_path / "study.zip", tmp_path / "out")
    figure = tmp_path / "out/figures/figure_1.svg"
    figure.write_text(figure.read_text() + " ")
    (tmp_path / "out/ro-crate-metadata.json").unlink()
    named = toy_study.python("workflow/verify.py", str(tmp_path / "out"))
    assert named.returncode == 1
    assert f"{figure}: has changed" in named.stdout


def test_archive_packs_no_file_out_of_the_study_and_replaces_none(copy, tmp_path):
    secret, archive = tmp_path / "secret.txt", tmp_path / "study.zip"
    secret.write_text("secret")
    archive.write_text("mine")
    done = copy.python("workflow/archive.py", ".", str(archive))
    assert (done.returncode, done.stderr.count("\n"), archive.read_text()) == (1, 1, "mine")
    assert f"{archive}: is there already" in done.stderr
    archive.unlink()
    crate = copy.folder / "ro-crate-metadata.json"
    content = read_json(crate)
    content["@graph"].append({"@id": "../secret.txt", "@type": "File", "sha256": sha256(secret)})
    write_json(crate, content)
    seal_of(crate).unlink()
    done = copy.python("workflow/archive.py", ".", str(archive))
    assert done.returncode == 1
    assert "ro-crate-metadata.json: lists ../secret.txt, which is no file of the study" in done.stderr
    assert not archive.exists()


def test_make_report_after_a_changed_config_shows_nothing_and_says_why(copy, toy_settings):
    """The real target, less the jobs that draw, which would only take their time."""
    shutil.copy(ROOT / "Makefile", copy.folder)
    (copy.folder / ".venv").symlink_to(sys.prefix)
    page = copy.folder / "report/report.html"
    before = page.read_bytes()
    make = ["make", "--assume-old=.venv/.ready", "report", "FROM_TABLES="]
    environment = os.environ | {"PYTHONPATH": str(copy.folder / "src")}
    with copy.configured(evaluation={"episodes": 20, "radius": 0.05}, **faster(toy_settings)):
        done = subprocess.run(make, cwd=copy.folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    told = (
        rf"{NONE}/\w+\.json: tells of settings\.cell\.protocol\.ppo\.learning_rate = 0\.0003, where 0\.01 is asked for"
    )
    assert re.search(told, done.stderr)
    assert "Traceback" not in done.stderr
    assert not page.exists() or page.read_bytes() == before


def test_blocks_of_different_versions_are_named(copy):
    manifest = copy.folder / DECAY / "manifest.json"
    text = manifest.read_text()
    mujoco = read_json(manifest)["versions"]["mujoco"]
    manifest.write_text(text.replace(f'"mujoco": "{mujoco}"', '"mujoco": "3.3.7"'))
    shutil.rmtree(manifest.parent / ".checksums")
    done = copy.snakemake(
        "--forcerun", "aggregate_runs", "--allowed-rules", "aggregate_runs", "--", "results/runs.parquet"
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert (
        "Blocks of different versions, so of bits that no one machine makes again: mujoco 3.17.0 and 3.3.7"
        in done.stderr
    )
    copy.run("--allowed-rules", "build_report", "--", "report/report.html")
    assert "mujoco 3.17.0 / 3.3.7" in Path(copy.folder / "report/report.html").read_text()


def keep(project: Project, *arguments: str):
    return project.python("workflow/keep_reference.py", *arguments)


def test_reference_run_is_never_half_replaced_and_not_by_a_toy_unasked(copy):
    kept, readme = copy.folder / "report/reference", copy.folder / "README.md"
    shutil.copy(ROOT / "README.md", readme)
    before, text = checksums(kept), readme.read_text()
    earlier = read_json(kept / "manifest.json")["experiments"]
    done = keep(copy)
    assert done.returncode == 1
    assert "it has 4 runs of the main study" in done.stderr
    assert done.stderr.count("\n") == 1
    assert (checksums(kept), readme.read_text()) == (before, text)
    with copy.edited("workflow/keep_reference.py", "    check_seal(figure)", "    __import__('os').kill(0, 9)"):
        assert keep(copy, "--force").returncode == -9
    assert (checksums(kept), readme.read_text()) == (before, text)
    done = keep(copy, "--force")
    assert done.returncode == 0, done.stderr
    record = read_json(kept / "manifest.json")
    assert record["tables"] == checksums(kept)
    assert "Kept all the same: it has 4 runs of the main study" in done.stderr
    further = {
        name: total
        for name, total in before.items()
        if name.startswith(("experiments/released/", "experiments/tuned/search/"))
    }
    assert further
    assert further.items() <= checksums(kept).items(), "a study that was not made here stays"
    assert record["experiments"]["released"] == earlier["released"]
    assert len(record["peers"]) > 0, "those of the studies that stay"
    assert record["blocks"][2]["cell"] == {
        "protocol": "paper",
        "variant": "decay200k_l2sq",
        "budget": 2048,
        "alpha0": 0.5,
    }
    assert readme.read_text() != text
    (kept / "claims.csv").write_text("edited")
    assert "report/reference/claims.csv: has changed since it was made" in copy.python("workflow/verify.py").stdout
