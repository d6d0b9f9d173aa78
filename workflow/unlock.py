"""Remove the lock that a killed Snakemake has left in a folder: only when none of its processes works there any more.

    python workflow/unlock.py [FOLDER]

Jobs outlive a killed Snakemake; they are waited for. A Snakemake that is alive keeps its lock.
Processes of other machines on a shared disk are not seen.
"""

import os
import sys
import time
from pathlib import Path


def main(folder: Path) -> None:
    locks = folder / ".snakemake" / "locks"
    waiting = False
    while locks.is_dir() and any(locks.iterdir()):
        commands = list(working_in(folder))
        if any(is_scheduler(command) for command in commands):
            return
        if not commands:
            for lock in locks.iterdir():
                lock.unlink()
            print(f"Removed the lock that a killed snakemake left in {folder}.")
            return
        if not waiting:
            print(f"Waiting for {len(commands)} processes that a killed snakemake left in {folder}.", flush=True)
            waiting = True
        time.sleep(1)


def working_in(folder: Path):
    """Command lines of Snakemake's processes whose working directory is `folder`."""
    for process in Path("/proc").glob("[0-9]*"):
        try:
            here = (process / "cwd").readlink() == folder.resolve()
            command = (process / "cmdline").read_text(errors="replace").split("\0")
        except OSError:  # it has ended, or is another user's
            continue
        names = [Path(part).name for part in command]
        if here and process.name != str(os.getpid()) and ("snakemake" in names or ".snakemake/scripts" in str(command)):
            yield command


def is_scheduler(command) -> bool:
    """Whether a command is a Snakemake that schedules jobs, not one that runs a single job for it."""
    return "snakemake" in [Path(part).name for part in command] and "--mode" not in command


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else ""))
