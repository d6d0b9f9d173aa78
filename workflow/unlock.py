"""Remove the lock that a killed Snakemake has left in a folder: only on its own machine and when it is gone.

    python workflow/unlock.py [--force] [FOLDER]

Jobs outlive a killed Snakemake; they are waited for. Where another Snakemake works in the folder, or may, one line
says which, and the exit code is 1. `--force` frees the folder all the same.
"""

import argparse
import sys
from pathlib import Path

from reacher_shaping.jobs import folder_lock


def main(folder: Path, *, force: bool) -> None:
    """Free the folder, or raise FolderTakenError."""
    holder = None if force else folder_lock.require_free(folder)
    locks = folder / ".snakemake" / "locks"
    left = list(locks.glob("*")) if locks.is_dir() else []
    if not left:
        folder_lock.forget(folder)
        return
    if holder is None and not force:
        raise folder_lock.FolderTakenError(folder, None, alive=False)
    if not force:
        wait_for_jobs(folder)
    for lock in left:
        lock.unlink(missing_ok=True)
    folder_lock.forget(folder)
    print(f"Removed the lock that {holder or 'a snakemake'} left in {folder}.")


def wait_for_jobs(folder: Path) -> None:
    """Return when no job works in the folder any more."""
    with folder_lock.no_jobs(folder, wait=False) as free:
        if free:
            return
    print(f"Waiting for the jobs that a killed snakemake left in {folder}.", flush=True)
    with folder_lock.no_jobs(folder, wait=True):
        return


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Remove the lock that a killed snakemake has left in a folder.")
    parser.add_argument("folder", type=Path, nargs="?", default=Path())
    parser.add_argument("--force", action="store_true", help="also where nothing tells that it is gone")
    given = parser.parse_args()
    try:
        main(given.folder, force=given.force)
    except folder_lock.FolderTakenError as error:
        sys.exit(str(error))
