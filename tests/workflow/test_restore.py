"""`make restore` on the real workflow: a study from an archive, in a folder of another path, and what it refuses."""

import json
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from project import Project

from reacher_shaping.storage.files import sha256

NONE, DECAY = "results/paper/none/2048/alpha1", "results/paper/decay200k_l2sq/2048/alpha0.5"
SCIENCE = ["policy.pt", "progress.parquet", "episodes.parquet", "monitor"]
CRATE = "ro-crate-metadata.json"


@pytest.fixture(scope="module")
def archive(toy_study, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("archive") / "study.zip"
    done = toy_study.python("workflow/archive.py", ".", str(path))
    assert done.returncode == 0, done.stderr
    return path


@pytest.fixture(scope="module")
def restored(archive, toy_settings, tmp_path_factory) -> Project:
    """The project in a folder of another path, where nothing was run but the restoring."""
    project = Project(tmp_path_factory.mktemp("another"), toy_settings)
    done = project.python("workflow/restore.py", str(archive))
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"4 blocks taken from {archive}; 4 of the {blocks(project)} of all studies are here.\n"
    return project


def blocks(project: Project) -> int:
    """How many blocks all studies of the project have."""
    done = project.python("workflow/cells.py")
    return sum(int(line.split(" seeds ")[0].split()[-1]) for line in done.stdout.splitlines()[:-1])


def policies(planned: dict[str, list[str]]) -> list[str]:
    """The blocks that a plan trains."""
    return sorted(name for name in planned.get("train_block", []) if name.endswith("policy.pt"))


def refusal(project: Project, source: Path) -> str:
    """The one line with which restoring ends, nothing having been taken."""
    done = project.python("workflow/restore.py", str(source))
    assert done.returncode == 1, done.stdout + done.stderr
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    assert not (project.folder / "results").exists()
    return done.stderr


def test_restored_study_has_nothing_to_train_or_evaluate(restored):
    planned = restored.planned()
    assert {"train_block", "evaluate_block"} & set(planned) == set()
    assert "aggregate_runs" in planned


def test_one_cell_changed_after_restoring_trains_that_cell_alone(restored, toy_settings):
    first, second = toy_settings["grid"]
    with restored.configured(grid=[first | {"ppo": {"learning_rate": 0.001}}, second]):
        assert policies(restored.planned()) == [f"{NONE}/seeds{seed}-{seed}/policy.pt" for seed in (0, 1)]
    with restored.configured(evaluation={"episodes": 21, "radius": 0.02}):
        planned = restored.planned()
    assert policies(planned) == []
    assert len([name for name in planned["evaluate_block"] if name.endswith("episodes.parquet")]) == 4


def test_report_of_a_restored_study_has_the_same_bytes(restored, toy_study, tmp_path):
    copy = restored.copied(tmp_path / "copy")
    copy.run("--", "report/report.html")
    assert (copy.folder / "report/report.html").read_bytes() == (toy_study.folder / "report/report.html").read_bytes()
    assert (copy.folder / "report/report.pdf").read_bytes() == (toy_study.folder / "report/report.pdf").read_bytes()
    logs = list(copy.folder.glob("results/logs/**/train.log"))
    assert not [path for path in logs if path.stat().st_size], "no training was run"


def test_what_differs_is_named_and_left_to_snakemake(archive, toy_settings, tmp_path):
    first, second = toy_settings["grid"]
    project = Project(tmp_path, toy_settings | {"grid": [first | {"ppo": {"learning_rate": 0.001}}, second]})
    done = project.python("workflow/restore.py", str(archive))
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0] == (
        "not taken: paper-none-2048-alpha1 has other settings: "
        "protocol.ppo.learning_rate 0.0003 there, 0.001 here (2 blocks)"
    )
    assert done.stdout.splitlines()[1].startswith(f"2 blocks taken from {archive}; 2 of ")
    assert policies(project.planned()) == [f"{NONE}/seeds{seed}-{seed}/policy.pt" for seed in (0, 1)]


def test_other_code_than_this_clones_is_named(archive, toy_settings, tmp_path):
    project = Project(tmp_path, toy_settings)
    with project.edited("src/reacher_shaping/training/ppo.py", "BETAS = (0.9, 0.999)", "BETAS = (0.9, 0.99)"):
        done = project.python("workflow/restore.py", str(archive))
    assert done.returncode == 0, done.stderr
    assert "not taken: paper-none-2048-alpha1 was trained by other code (2 blocks)" in done.stdout
    assert "\n0 blocks taken" in done.stdout


def test_other_block_size_is_filled_from_the_blocks_that_are_there(toy_study, toy_settings, tmp_path):
    """With the bytes that training the larger block gives."""
    copy = toy_study.copied(tmp_path / "copy")
    trained = Project(tmp_path / "trained", toy_settings | {"seeds_per_block": 2})
    with copy.configured(seeds_per_block=2):
        assert len(policies(copy.planned())) == 2
        done = copy.python("workflow/restore.py", ".")
        assert done.returncode == 0, done.stderr
        assert "2 blocks taken" in done.stdout
        assert {"train_block", "evaluate_block"} & set(copy.planned()) == set()
    trained.run("--", f"{NONE}/seeds0-1/episodes.parquet")
    for name in SCIENCE:
        assert sha256(copy.folder / NONE / "seeds0-1" / name) == sha256(trained.folder / NONE / "seeds0-1" / name)


def changed(archive: Path, into: Path, change: Callable[[dict[str, bytes]], None]) -> Path:
    """A copy of an archive whose files, by name, were changed."""
    with zipfile.ZipFile(archive) as packed:
        files = {name: packed.read(name) for name in packed.namelist()}
    change(files)
    with zipfile.ZipFile(into, "w") as packed:
        for name, content in files.items():
            packed.writestr(name, content)
    return into


def tampered_policy(files):
    name = f"{NONE}/seeds0-0/policy.pt"
    files[name] = files[name][:-1] + bytes([files[name][-1] ^ 1])


def foreign_file(files):
    files["results/paper/notes.txt"] = b"mine"


def path_out_of_the_folder(files):
    files["../out.txt"] = b"mine"


def no_crate(files):
    del files[CRATE]


def changed_crate(files):
    files[CRATE] = files[CRATE].replace(b"runs.parquet", b"rums.parquet", 1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (tampered_policy, f"study.zip: {NONE}/seeds0-0/policy.pt: has changed since it was made"),
        (foreign_file, "study.zip: results/paper/notes.txt: is not in its list of files"),
        (path_out_of_the_folder, "study.zip: holds '../out.txt', a path out of its folder"),
        (no_crate, f"study.zip: holds no {CRATE}; give an archive of `make archive`"),
        (changed_crate, f"study.zip: {CRATE}: has changed since it was written"),
    ],
)
def test_archive_that_is_not_as_it_was_packed_is_refused(archive, bare, tmp_path, change, words):
    assert words in refusal(bare, changed(archive, tmp_path / "study.zip", change))


def test_record_that_names_files_out_of_its_block_is_refused(archive, bare, tmp_path):
    """Of an archive made to be believed: its list of files, checksums and seals are those of its files."""
    folder = tmp_path / "study"
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(folder)
    manifest = folder / f"{NONE}/seeds0-0/manifest.json"
    record = json.loads(manifest.read_text())
    record["outputs"]["../../../../../../config.yaml"] = sha256(folder / "results/settings.json")
    shutil.copy(folder / "results/settings.json", folder / "config.yaml")
    manifest.write_text(json.dumps(record))
    config = (bare.folder / "config.yaml").read_bytes()
    assert "names '../../../../../../config.yaml', no file of a block" in refusal(bare, folder)
    assert (bare.folder / "config.yaml").read_bytes() == config


def test_archive_with_a_flipped_bit_is_refused(archive, bare, tmp_path):
    content = bytearray(archive.read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "study.zip").write_bytes(content)
    assert "study.zip: " in refusal(bare, tmp_path / "study.zip")


def test_what_is_no_archive_is_refused(bare, tmp_path):
    assert "none.zip: is no archive that can be read" in refusal(bare, tmp_path / "none.zip")
    (tmp_path / "text.zip").write_text("no zip")
    assert "text.zip: is no archive that can be read" in refusal(bare, tmp_path / "text.zip")


@pytest.fixture
def bare(tmp_path, toy_settings) -> Project:
    """The project where nothing was run."""
    return Project(tmp_path / "bare", toy_settings)
