"""The study as a research object: an RO-Crate that lists every published file with its checksum and how it came about.

Workflow RO-Crate 1.1 (https://w3id.org/workflowhub/workflow-ro-crate), written with the `rocrate` library.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from rocrate.model import ContextEntity
from rocrate.rocrate import ROCrate

from reacher_shaping.storage.files import ArtifactError, check_seal, read_json, sha256

METADATA = "ro-crate-metadata.json"
BINARY = "application/octet-stream"
FORMATS = {
    ".csv": "text/csv",
    ".gif": "image/gif",
    ".html": "text/html",
    ".ipynb": "application/x-ipynb+json",
    ".json": "application/json",
    ".md": "text/markdown",
    ".mp4": "video/mp4",
    ".parquet": "application/vnd.apache.parquet",
    ".pdf": "application/pdf",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".txt": "text/plain",
}


def describe(
    files: Sequence[Path], *, settings: Path, manifests: Sequence[Mapping[str, Any]], name: str, description: str
) -> dict[str, Any]:
    """Return the content of `ro-crate-metadata.json` for a study.

    Args:
        files: every file of the study, relative to the crate's root, which is the working directory.
        settings: the one of them that holds the resolved settings.
        manifests: the blocks' manifests; the crate tells their code versions, packages, machines and times.
        name: of the study.
        description: one sentence on it.

    Raises ArtifactError where a file cannot be read. Equal files and manifests give an equal crate.
    """
    crate = ROCrate()
    crate.name, crate.description = name, description
    crate.license = "https://spdx.org/licenses/MIT"
    finished = sorted(manifest["evaluation"]["finished"] for manifest in manifests)
    crate.datePublished = finished[-1]
    for path in sorted(files):
        crate.add_file(
            path,
            dest_path=str(path),
            properties={
                "name": path.name,
                "encodingFormat": FORMATS.get(path.suffix, BINARY),
                "sha256": sha256(path),
                "contentSize": path.stat().st_size,
            },
        )
    versions = {f"{package}=={version}" for manifest in manifests for package, version in manifest["versions"].items()}
    packages = [
        _add(crate, f"#{pin}", "SoftwareApplication", name=pin.split("==")[0], version=pin.split("==")[1])
        for pin in sorted(versions)
    ]
    machines = [
        _add(crate, f"#machine-{number}", "PropertyValue", name="machine", value=machine)
        for number, machine in enumerate(sorted({_machine(manifest["machine"]) for manifest in manifests}), start=1)
    ]
    codes = [
        _add(crate, f"#code-{number}", "SoftwareSourceCode", name="reacher-shaping", version=version)
        for number, version in enumerate(sorted({_commit(manifest["git"]) for manifest in manifests}), start=1)
    ]
    run = _add(
        crate, "#study", "CreateAction", name=name,
        startTime=min(manifest["started"] for manifest in manifests), endTime=finished[-1],
    )  # fmt: skip
    run["instrument"] = [*codes, *packages]
    run["object"] = [crate.dereference(str(settings))]
    run["environment"] = machines
    run["result"] = [crate.dereference("./")]
    crate.root_dataset["mentions"] = [run]
    content: dict[str, Any] = crate.metadata.generate()
    return content


def read_manifest(path: Path | str) -> dict[str, Any]:
    """Read a block's manifest. Raises ArtifactError if it lacks what a crate tells of it."""
    manifest = read_json(path)
    evaluation = manifest.get("evaluation")
    missing = [name for name in ("started", "versions", "machine", "git") if name not in manifest]
    if not isinstance(evaluation, Mapping) or "finished" not in evaluation:
        missing.append("evaluation.finished")
    if missing:
        raise ArtifactError(path, f"has no {missing[0]}")
    return manifest


def checksums(path: Path) -> dict[str, str]:
    """Return file name -> SHA-256 as a crate's metadata file says. Raises ArtifactError if it is none."""
    check_seal(path)
    graph = read_json(path).get("@graph")
    try:
        found = {entity["@id"]: entity["sha256"] for entity in graph if entity["@type"] == "File"}  # type: ignore[union-attr]
    except (TypeError, KeyError) as error:
        raise ArtifactError(path, f"is no crate of this project ({error!r})") from None
    if not all(isinstance(text, str) for pair in found.items() for text in pair):
        raise ArtifactError(path, "is no crate of this project")
    outside = [name for name in found if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts]
    if outside:
        raise ArtifactError(path, f"lists {outside[0]}, which is no file of the study")
    return found


def _add(crate: ROCrate, identifier: str, kind: str, **properties: str) -> ContextEntity:
    return crate.add(ContextEntity(crate, identifier, properties={"@type": kind, **properties}))


def _machine(machine: Mapping[str, Any]) -> str:
    return f"{machine['cpu']}, {machine['cores']} cores, {machine['system']}"


def _commit(git: Mapping[str, Any]) -> str:
    return f"{git['commit'] or 'unknown'}{', with local changes' if git['dirty'] else ''}"
