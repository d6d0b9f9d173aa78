"""The description of a study as a research object; the workflow's own crate is tested in test_workflow.py."""

import json
from pathlib import Path

import pytest

from reacher_shaping.storage import crate
from reacher_shaping.storage.files import ArtifactError, sha256, write_json, write_text

MANIFESTS = [
    {
        "started": f"2026-01-0{day}T00:00:00+00:00",
        "evaluation": {"finished": f"2026-01-0{day}T01:00:00+00:00"},
        "versions": {"torch": "2", "mujoco": version},
        "machine": {"cpu": "a processor", "cores": cores, "system": "Linux"},
        "git": {"commit": "abc", "dirty": dirty},
    }
    for day, version, cores, dirty in ((2, "3.1", 2, False), (1, "3.2", 2, True), (3, "3.2", 4, True))
]


@pytest.fixture
def described(tmp_path, monkeypatch):
    """A function that describes three made-up files, in the order given."""
    monkeypatch.chdir(tmp_path)
    for name in ("results/settings.json", "results/runs.parquet", "figures/a.svg"):
        write_text(name, name)

    def describe(*names):
        files = [Path(name) for name in names or ("results/settings.json", "results/runs.parquet", "figures/a.svg")]
        return crate.describe(files, settings=files[0], manifests=MANIFESTS, name="study", description="A study.")

    return describe


def entity(content, identifier):
    [found] = [entity for entity in content["@graph"] if entity["@id"] == identifier]
    return found


def test_crate_tells_files_times_versions_machines_and_code(described):
    content = described()
    assert entity(content, "figures/a.svg")["sha256"] == sha256("figures/a.svg")
    assert entity(content, "figures/a.svg")["encodingFormat"] == "image/svg+xml"
    assert entity(content, "results/runs.parquet")["contentSize"] == len("results/runs.parquet")
    study = entity(content, "#study")
    assert (study["startTime"], study["endTime"]) == ("2026-01-01T00:00:00+00:00", "2026-01-03T01:00:00+00:00")
    assert study["object"] == [{"@id": "results/settings.json"}]
    used = [entity(content, tool["@id"]) for tool in study["instrument"]]
    versions = {(tool["name"], tool["version"]) for tool in used}
    assert versions == {
        ("torch", "2"),
        ("mujoco", "3.1"),
        ("mujoco", "3.2"),
        ("reacher-shaping", "abc"),
        ("reacher-shaping", "abc, with local changes"),
    }
    machines = [entity(content, machine["@id"])["value"] for machine in study["environment"]]
    assert machines == ["a processor, 2 cores, Linux", "a processor, 4 cores, Linux"]
    assert entity(content, "./")["datePublished"] == study["endTime"]


def test_equal_studies_have_equal_crates_in_any_order_of_files(described):
    other = described("results/settings.json", "figures/a.svg", "results/runs.parquet")
    assert json.dumps(described()) == json.dumps(other)


def test_file_that_is_not_there_is_named(described):
    with pytest.raises(ArtifactError, match=r"figures/b\.svg"):
        described("results/settings.json", "figures/b.svg")


def test_checksums_of_a_crate_come_back(described):
    write_json(crate.METADATA, described())
    names = {"results/settings.json", "results/runs.parquet", "figures/a.svg"}
    assert crate.checksums(Path(crate.METADATA)) == {name: sha256(name) for name in names}


@pytest.mark.parametrize(
    "content", [{}, {"@graph": 3}, {"@graph": [{}]}, {"@graph": [{"@type": "File", "@id": "a"}]},
                {"@graph": [{"@type": "File", "@id": "a", "sha256": 1}]}]
)  # fmt: skip
def test_other_metadata_is_refused(tmp_path, content):
    write_json(tmp_path / "crate.json", content)
    with pytest.raises(ArtifactError, match=r"crate\.json: is no crate of this project"):
        crate.checksums(tmp_path / "crate.json")


@pytest.mark.parametrize("name", ["../secret", "results/../../secret", "/etc/passwd"])
def test_crate_that_lists_a_file_out_of_its_folder_is_refused(tmp_path, name):
    graph = [{"@type": "File", "@id": name, "sha256": "0" * 64}]
    write_json(tmp_path / "crate.json", {"@graph": graph})
    with pytest.raises(ArtifactError, match=r"crate\.json: lists .*, which is no file of the study"):
        crate.checksums(tmp_path / "crate.json")
