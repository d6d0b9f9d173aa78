"""Recompute the checksums that a study's manifests and crate hold, and say what differs.

    python workflow/verify.py [FOLDER]

Ends with 1 if a file is missing or has another content than when it was made.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

from reacher_shaping import artifacts
from reacher_shaping.crate import METADATA, checksums

MANIFESTS = "results/*/*/*/*/*/manifest.json"


def block_problems(folder: Path) -> list[str]:
    """One line per file that is not what its block's manifest says, or per manifest that cannot be read."""
    found = []
    for path in sorted(folder.glob(MANIFESTS)):
        try:
            found += differing(path.parent, artifacts.read_json(path)["outputs"])
        except (artifacts.ArtifactError, KeyError) as error:
            found.append(str(error) if isinstance(error, artifacts.ArtifactError) else f"{path}: holds no outputs")
    return found


def crate_problems(folder: Path) -> list[str]:
    """The same for the files that the study's crate lists."""
    try:
        return differing(folder, checksums(folder / METADATA))
    except artifacts.ArtifactError as error:
        return [str(error)]


def differing(folder: Path, expected: Mapping[str, str]) -> list[str]:
    """One line per file of `folder` that has not the checksum expected."""
    found = []
    for name, checksum in expected.items():
        file = folder / name
        if not file.exists():
            found.append(f"{file}: is missing; snakemake makes it again")
        elif artifacts.sha256(file) != checksum:
            found.append(f"{file}: has changed since it was made; delete it and run snakemake again")
    return found


def main(folder: Path) -> int:
    """Print what is wrong, or how much is right; return the exit code."""
    blocks = len(list(folder.glob(MANIFESTS)))
    crate = (folder / METADATA).exists()
    found = list(dict.fromkeys(block_problems(folder) + (crate_problems(folder) if crate else [])))
    more = f", and all {len(checksums(folder / METADATA))} of the study's crate" if crate and not found else ""
    print("\n".join(found) or f"The files of {blocks} seed blocks in {folder / 'results'} are as they were made{more}.")
    return bool(found) or not blocks


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "")))
