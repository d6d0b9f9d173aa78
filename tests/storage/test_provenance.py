import subprocess

import pytest

from reacher_shaping.storage.files import ArtifactError, write_json
from reacher_shaping.storage.provenance import git_state, machine, mixed_versions, unchanged, versions


def test_file_that_no_manifest_knows_names_the_manifest(tmp_path):
    (tmp_path / "policy.pt").write_text("weights")
    write_json(tmp_path / "training.json", {"outputs": {"other.pt": "0"}})
    with pytest.raises(ArtifactError, match=r"training\.json: has no checksum of policy\.pt; delete it"):
        unchanged(tmp_path / "policy.pt")


def test_state_of_a_folder_outside_git_is_unknown(tmp_path):
    assert git_state(tmp_path) == {"commit": None, "dirty": None}


def repository(folder):
    """A repository with one commit; returns the commit."""
    folder.mkdir()
    (folder / "file").write_text("text")
    for command in (
        ["init"],
        ["add", "."],
        ["-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false", "commit", "-m", "first"],
    ):
        subprocess.run(["git", "-C", folder, *command], check=True, capture_output=True)
    return subprocess.run(["git", "-C", folder, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout


def test_state_of_a_repository_is_its_own_commit_and_whether_files_differ(tmp_path):
    commit = repository(tmp_path / "clone").strip()
    assert git_state(tmp_path / "clone") == {"commit": commit, "dirty": False}
    (tmp_path / "clone" / "new").write_text("untracked")
    assert git_state(tmp_path / "clone") == {"commit": commit, "dirty": True}


def test_unpacked_archive_inside_a_repository_has_no_commit(tmp_path):
    repository(tmp_path / "other")
    unpacked = tmp_path / "other" / "deep" / "reacher-shaping"
    unpacked.mkdir(parents=True)
    assert git_state(unpacked) == {"commit": None, "dirty": None}


@pytest.mark.parametrize("way", ["GIT_DIR", "GIT_WORK_TREE", "symlink"])
def test_no_other_repository_is_taken_for_the_clones_by_any_way_of_being_told(tmp_path, monkeypatch, way):
    own, other = repository(tmp_path / "own").strip(), tmp_path / "other"
    repository(other)
    unpacked = other / "unpacked"
    unpacked.mkdir()
    monkeypatch.setenv("GIT_DIR", str(other / ".git"))
    if way == "GIT_WORK_TREE":
        monkeypatch.setenv(way, str(other))
    elif way == "symlink":
        unpacked = tmp_path / "link"
        unpacked.symlink_to(other / "unpacked")
    else:
        monkeypatch.setenv(way, str(other / ".git"))
    assert git_state(unpacked) == {"commit": None, "dirty": None}
    assert git_state(tmp_path / "own") == {"commit": own, "dirty": False}


def test_versions_that_bits_hang_on_are_named_where_records_differ():
    same = {"torch": "2", "mujoco": "3", "pandas": "1"}
    assert mixed_versions([{"versions": same}, {"versions": same | {"pandas": "2"}}]) == ""
    assert mixed_versions([{"versions": same | {"torch": "3"}}, {"versions": same}]) == "torch 2 and 3"


def test_machine_and_versions_are_named():
    assert machine()["cpu"]
    assert machine()["cores"] >= 1
    assert {"python", "torch", "mujoco"} <= versions().keys()
