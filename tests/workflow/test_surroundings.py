"""Whoever runs it, and wherever it lies, a study is the same: home folder, display, Git and the folder's path."""

import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest
from project import ROOT, Project

from reacher_shaping.storage.files import read_json, sha256

MATPLOTLIBRC = """
savefig.transparent: True
savefig.bbox: tight
text.color: white
axes.labelcolor: white
text.usetex: True
"""
STARTUP = """
import pandas
pandas.set_option("display.precision", 1)
pandas.read_parquet = lambda *_, **__: pandas.DataFrame({"x": [1]})
"""
EXPORTER = "c.HTMLExporter.exclude_input = True"


def personal(home: Path) -> Path:
    """A home folder with settings of a person's own taste."""
    for name, text in {
        ".config/matplotlib/matplotlibrc": MATPLOTLIBRC,
        ".ipython/profile_default/startup/00.py": STARTUP,
        ".jupyter/jupyter_nbconvert_config.py": EXPORTER,
    }.items():
        (home / name).parent.mkdir(parents=True)
        (home / name).write_text(text)
    return home


NONE = "results/paper/none/2048/alpha1/seeds0-0"
MADE = ["figures", "report/report.html", "report/notebooks", "results/tables", "results/media", "results/notebooks"]

AGAIN = [
    *["figures", "results/tables", "results/notebooks/story.ipynb", "report/notebooks/story.html"],
    *["results/media/paper-none-2048-alpha1.gif", "report/report.html"],
]


def shown(project: Project) -> dict[str, str]:
    """Checksums of all that is drawn and written from the tables."""
    files = [path for name in MADE for path in [project.folder / name, *(project.folder / name).rglob("*.*")]]
    files = [path for path in files if path.is_file() and path.parent.name != ".checksums"]
    return {str(path.relative_to(project.folder)): sha256(path) for path in files}


@pytest.mark.parametrize("home", ["personal", "unwritable"])
def test_home_folder_and_a_display_that_is_gone_change_no_byte(toy_study, copy, tmp_path, home):
    place = personal(tmp_path / "home") if home == "personal" else Path("/dev/null/home")
    copy.environment = {"HOME": str(place), "XDG_CACHE_HOME": None, "XDG_CONFIG_HOME": None, "DISPLAY": ":987"}
    for name in AGAIN:
        path = copy.folder / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    assert shown(copy).keys() < shown(toy_study).keys()
    copy.run("--", *(name for name in shown(toy_study)))
    assert shown(copy) == shown(toy_study)


def test_commit_of_another_repository_gets_into_no_manifest(copy, tmp_path):
    for command in (["init"], ["-c", "user.name=a", "-c", "user.email=a@b.c", "commit", "--allow-empty", "-m", "a"]):
        subprocess.run(["git", "-C", tmp_path, *command], check=True, capture_output=True)
    copy.environment = {"GIT_DIR": str(tmp_path / ".git")}
    copy.run("--force", "--", f"{NONE}/training.json")
    assert read_json(copy.folder / NONE / "training.json")["git"] == {"commit": None, "dirty": None}


@pytest.mark.parametrize("name", ["a b", "it's", 'say "x"', "cost$", "a;b", "a&b", "(1)", "a#b", "a:b"])
def test_setup_in_a_folder_that_no_job_can_run_in_ends_before_anything_is_installed(tmp_path, name):
    clone = tmp_path / name
    (clone / "workflow").mkdir(parents=True)
    for file in ("Makefile", "pyproject.toml", "requirements.txt", "workflow/install.py"):
        shutil.copy(ROOT / file, clone / file)
    shell = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}  # not `make test`
    done = subprocess.run(["make", "setup"], cwd=clone, env=shell, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    [line] = [line for line in done.stderr.splitlines() if not line.startswith("make:")]
    assert line.startswith(f"{clone}: Snakemake starts no job from a folder with a space, a quote or the like")
    assert done.stdout == ""
    assert not (clone / ".venv").exists()


@pytest.mark.parametrize("name", ["a b", "it's", "a#b"])
def test_python_by_whose_path_no_job_starts_ends_with_one_line(toy_study, tmp_path, name):
    """As where a clone was moved after its setup."""
    folder = tmp_path / name / ".venv"
    venv.create(folder, symlinks=True)
    [packages] = folder.glob("lib/python*/site-packages")
    (packages / "others.pth").write_text("\n".join(filter(os.path.isdir, sys.path)) + "\n")
    environment = os.environ | {"PYTHONPATH": str(toy_study.folder / "src")}
    command = [folder / "bin/python", "-m", "snakemake", "--dry-run"]
    done = subprocess.run(command, cwd=toy_study.folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    [line] = [line for line in done.stderr.splitlines() if "profile" not in line]
    assert line.startswith(f"{folder}/bin/python: Snakemake starts no job by a Python with ")
    assert line.endswith("in its path; move the clone")
