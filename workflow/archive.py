"""Pack a study into one zip, ready for a repository such as Zenodo.

    python workflow/archive.py [FOLDER [ZIP]]

The zip holds the files that the study's crate lists, the crate's metadata and the seals that the jobs left beside the
files; the same files give the same bytes.
Ends with 1, and packs nothing, if a file is missing or has another content than the crate says, or if another file than
the archive made before would be replaced.
"""

import sys
import zipfile
from pathlib import Path

from verify import crate_problems

from reacher_shaping.storage.crate import METADATA, checksums
from reacher_shaping.storage.files import ArtifactError, replacing, require_writable, seal_of

USUAL = Path("build/reacher-shaping-study.zip")
EARLIEST = (1980, 1, 1, 0, 0, 0)  # of a zip's time stamps; the files' own would differ from copy to copy


def pack(folder: Path, archive: Path) -> int:
    """Write the zip; return how many files it holds."""
    names = [METADATA, *sorted(checksums(folder / METADATA))]
    with replacing(archive) as temporary, zipfile.ZipFile(temporary, "w") as packed:
        seals = [str(seal) for seal in map(seal_of, names) if (folder / seal).exists()]
        for name in [*names, *seals]:
            entry = zipfile.ZipInfo(name, EARLIEST)
            entry.external_attr = 0o644 << 16
            packed.writestr(entry, (folder / name).read_bytes(), zipfile.ZIP_DEFLATED, compresslevel=6)
    return len(names)


def main(folder: Path, archive: Path) -> int:
    """Check the files, pack them, say so; return the exit code."""
    if not (folder / METADATA).exists():
        print(f"{folder / METADATA}: does not exist; run the study first: make reproduce", file=sys.stderr)
        return 1
    found = crate_problems(folder)
    if found:
        print("\n".join(found), file=sys.stderr)
        return 1
    try:
        require_writable(archive, [], force=archive == folder / USUAL)
        count = pack(folder, archive)
    except ArtifactError as error:
        print(error, file=sys.stderr)
        return 1
    print(f"{count} files, {archive.stat().st_size / 1e6:.0f} MB: {archive}")
    return 0


if __name__ == "__main__":
    given = [Path(argument) for argument in sys.argv[1:]]
    folder = given[0] if given else Path()
    sys.exit(main(folder, given[1] if len(given) > 1 else folder / USUAL))
