import pytest

from reacher_shaping.storage.files import ArtifactError, write_json
from reacher_shaping.storage.provenance import git_state, machine, unchanged, versions


def test_file_that_no_manifest_knows_names_the_manifest(tmp_path):
    (tmp_path / "policy.pt").write_text("weights")
    write_json(tmp_path / "training.json", {"outputs": {"other.pt": "0"}})
    with pytest.raises(ArtifactError, match=r"training\.json: has no checksum of policy\.pt; delete it"):
        unchanged(tmp_path / "policy.pt")


def test_state_of_a_folder_outside_git_is_unknown(tmp_path):
    assert git_state(tmp_path) == {"commit": None, "dirty": None}


def test_machine_and_versions_are_named():
    assert machine()["cpu"]
    assert machine()["cores"] >= 1
    assert {"python", "torch", "mujoco"} <= versions().keys()
