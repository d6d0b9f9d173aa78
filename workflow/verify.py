"""Recompute the checksums that the manifests hold, and say what differs.

    python workflow/verify.py [RESULTS]

Ends with 1 if a file is missing or has another content than when it was made.
"""

import sys
from pathlib import Path

from reacher_shaping import artifacts


def problems(results: Path) -> list[str]:
    """One line per file that is not what its block's manifest says, or per manifest that cannot be read."""
    found = []
    for path in sorted(results.glob("*/*/*/*/*/manifest.json")):
        try:
            outputs = artifacts.read_json(path)["outputs"]
        except (artifacts.ArtifactError, KeyError) as error:
            found.append(str(error) if isinstance(error, artifacts.ArtifactError) else f"{path}: holds no outputs")
            continue
        for name, checksum in outputs.items():
            file = path.parent / name
            if not file.exists():
                found.append(f"{file}: is missing; snakemake makes it again")
            elif artifacts.sha256(file) != checksum:
                found.append(f"{file}: has changed since it was made; delete it and run snakemake again")
    return found


def main(results: Path) -> int:
    """Print what is wrong, or how much is right; return the exit code."""
    count = len(list(results.glob("*/*/*/*/*/manifest.json")))
    found = problems(results)
    print("\n".join(found) or f"The files of {count} seed blocks in {results} are those of their manifests.")
    return bool(found) or not count


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "results")))
