"""Recompute the checksums that a study's manifests and crate hold, and say what differs.

    python workflow/verify.py [FOLDER]

Ends with 1 if a file is missing or has another content than when it was made.
"""

import sys
from pathlib import Path

from reacher_shaping.storage.crate import METADATA, checksums
from reacher_shaping.storage.files import ArtifactError, read_json
from reacher_shaping.storage.provenance import changed_outputs, differing

MADE = ("results", "figures", "report")  # folders of what the jobs make


def blocks(folder: Path) -> list[Path]:
    """Folders of the seed blocks that were trained."""
    return sorted(
        {path.parent for path in folder.glob("results/*/*/*/*/*/*") if path.name in {"policy.pt", "manifest.json"}}
    )


def block_problems(folder: Path) -> list[str]:
    """One line per file that is not what its block's manifests say, or per manifest that is missing or damaged."""
    found: list[str] = []
    for block in blocks(folder):
        long = block / "long_episodes.json"
        for path in [block / "manifest.json", *([long] if long.exists() else [])]:
            try:
                found += changed_outputs(path) if path.exists() else differing(block, {path.name: ""})
            except ArtifactError as error:
                found.append(str(error))
    return found


def seal_problems(folder: Path) -> list[str]:
    """The same for the files that are sealed by the jobs that made them: tables, figures, notebooks, videos, report."""
    found: list[str] = []
    for seal in (seal for part in MADE for seal in sorted(folder.glob(f"{part}/**/.checksums/*"))):
        file = seal.parent.parent / seal.name
        found += differing(file.parent, {file.name: seal.read_text(errors="replace").strip()} if file.exists() else {})
    return found


def reference_problems(folder: Path) -> list[str]:
    """The same for the files of the reference run that is kept there, by its manifest."""
    manifest = folder / "report" / "reference" / "manifest.json"
    tables = read_json(manifest).get("tables", {}) if manifest.exists() else {}
    return differing(manifest.parent, tables)


def crate_problems(folder: Path) -> list[str]:
    """The same for the files that the study's crate lists."""
    try:
        return differing(folder, checksums(folder / METADATA))
    except ArtifactError as error:
        return [str(error)]


def main(folder: Path) -> int:
    """Print what is wrong, or how much is right; return the exit code."""
    count, crate = len(blocks(folder)), folder / METADATA
    found = reference_problems(folder)
    if not count:
        print("\n".join([*found, f"{folder / 'results'}: holds no seed blocks; run the study first: make reproduce"]))
        return 1
    found = block_problems(folder) + seal_problems(folder) + found
    found += crate_problems(folder) if crate.exists() else []
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
