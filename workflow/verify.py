"""Recompute the checksums that a study's manifests and crate hold, and say what differs.

    python workflow/verify.py [FOLDER]

Ends with 1 if a file is missing or has another content than when it was made.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

from reacher_shaping.storage.crate import METADATA, checksums
from reacher_shaping.storage.files import ArtifactError, read_json, sha256


def blocks(folder: Path) -> list[Path]:
    """Folders of the seed blocks that were trained."""
    return sorted(
        {path.parent for path in folder.glob("results/*/*/*/*/*/*") if path.name in {"policy.pt", "manifest.json"}}
    )


def block_problems(folder: Path) -> list[str]:
    """One line per file that is not what its block's manifest says, or per manifest that is missing or damaged."""
    found = []
    for block in blocks(folder):
        path = block / "manifest.json"
        try:
            outputs = read_json(path).get("outputs") if path.exists() else {path.name: ""}
            if not isinstance(outputs, Mapping):
                raise ArtifactError(path, "holds no outputs")
            found += differing(block, outputs)
        except ArtifactError as error:
            found.append(str(error))
    return found


def crate_problems(folder: Path) -> list[str]:
    """The same for the files that the study's crate lists."""
    try:
        return differing(folder, checksums(folder / METADATA))
    except ArtifactError as error:
        return [str(error)]


def differing(folder: Path, expected: Mapping[str, str]) -> list[str]:
    """One line per file of `folder` that has not the checksum expected."""
    found = []
    for name, checksum in expected.items():
        file = folder / name
        if not file.exists():
            found.append(f"{file}: is missing; snakemake makes it again")
        elif sha256(file) != checksum:
            found.append(f"{file}: has changed since it was made; delete it and run snakemake again")
    return found


def main(folder: Path) -> int:
    """Print what is wrong, or how much is right; return the exit code."""
    count, crate = len(blocks(folder)), folder / METADATA
    if not count:
        print(f"{folder / 'results'}: holds no seed blocks; run the study first: make reproduce")
        return 1
    found = block_problems(folder) + (crate_problems(folder) if crate.exists() else [])
    if found:
        print("\n".join(dict.fromkeys(found)))
        return 1
    print(f"The files of {count} seed blocks in {folder / 'results'} are as they were made", end="")
    if crate.exists():
        print(f", and all {len(checksums(crate))} of the study's crate.")
    else:
        print(
            f"; tables, figures and report were not checked: {crate} is not there, snakemake makes it at a study's end."
        )
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "")))
