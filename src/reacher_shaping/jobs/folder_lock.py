"""Who works in a study's folder: one scheduler at a time, and the jobs that it started.

The scheduler holds a kernel lock (flock) on a file that names it, so its end, however it comes, is seen by every user
and from every container of its machine. Jobs share a second lock, so the jobs that outlive a killed scheduler are seen
too. On a disk that several machines share, locks of another machine may not be seen: there the name in the file
decides, and a holder of another host counts as alive.
"""

from __future__ import annotations

import fcntl
import getpass
import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

HOLDER, JOBS = "holder.json", "jobs.lock"


@dataclass(frozen=True)
class Holder:
    """A scheduler: host and its machine's identity, user, process, and when it began."""

    host: str
    machine: str
    user: str
    process: int
    since: str

    @classmethod
    def this(cls) -> Holder:
        """The process that asks."""
        return cls(socket.gethostname(), machine(), user(), os.getpid(), f"{datetime.now(UTC):%Y-%m-%d %H:%M UTC}")

    def is_here(self) -> bool:
        """Whether it ran on this machine, so that its lock tells whether it lives."""
        return (self.host, self.machine) == (socket.gethostname(), machine())

    def __str__(self) -> str:
        return f"process {self.process} of {self.user} on {self.host}, since {self.since}"


class FolderTakenError(RuntimeError):
    """Another scheduler works in the folder, or may; the message says which and how to free the folder."""

    def __init__(self, folder: Path, holder: Holder | None, *, alive: bool):
        free = f"python workflow/unlock.py --force {folder}"
        if alive:
            text = f"is in use by snakemake, {holder or 'which has left no name'}; wait for it or end it"
        elif holder is None:
            text = f"is locked by a snakemake that left no name; if none works there, free it with: {free}"
        else:
            text = f"is in use by snakemake, {holder}; if it has ended there, free the folder with: {free}"
        super().__init__(f"{folder.resolve()}: {text}")


def hold(folder: Path) -> IO[str]:
    """Take the folder for this process and return the file that stands for it, to be kept open until the end.

    folder: the study's folder; the files lie in its `.snakemake`. Raises FolderTakenError.
    """
    path = folder / ".snakemake" / HOLDER
    path.parent.mkdir(parents=True, exist_ok=True)
    file = path.open("a+", encoding="utf-8")
    try:
        _require_free(folder, file, fcntl.LOCK_EX)
    except FolderTakenError:
        file.close()
        raise
    _write(file, json.dumps(asdict(Holder.this())))
    return file


def require_free(folder: Path) -> Holder | None:
    """Return who held the folder last and has gone without a word, or None. Raises FolderTakenError."""
    try:
        with (folder / ".snakemake" / HOLDER).open(encoding="utf-8") as file:
            return _require_free(folder, file, fcntl.LOCK_SH)
    except FileNotFoundError:
        return None


def release(file: IO[str]) -> None:
    """Give the folder back."""
    _write(file, "")
    file.close()


def forget(folder: Path) -> None:
    """Strike out the name of a holder that has ended."""
    with suppress(FileNotFoundError), (folder / ".snakemake" / HOLDER).open("r+", encoding="utf-8") as file:
        _write(file, "")


@contextmanager
def job(folder: Path) -> Iterator[None]:
    """Show, as long as the context lasts, that a job works in the folder."""
    path = folder / ".snakemake" / JOBS
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        _lock(file, fcntl.LOCK_SH)
        yield


@contextmanager
def no_jobs(folder: Path, *, wait: bool) -> Iterator[bool]:
    """Whether no job works in the folder; with `wait`, once none does any more."""
    path = folder / ".snakemake" / JOBS
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        yield _lock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB) is not False


def user() -> str:
    """The name of this process's user, or its number where it has no name."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def machine() -> str:
    """What tells this machine from another of the same host name; empty where the system does not say."""
    try:
        return Path("/etc/machine-id").read_text(encoding="utf-8").strip()
    except OSError:
        return ""


def _require_free(folder: Path, file: IO[str], kind: int) -> Holder | None:
    holder, locked = _read(file), _lock(file, kind | fcntl.LOCK_NB)
    if locked is False:
        raise FolderTakenError(folder, holder, alive=True)
    if holder and (locked is None or not holder.is_here()):
        raise FolderTakenError(folder, holder, alive=False)
    return holder


def _lock(file: IO[str], kind: int) -> bool | None:
    """Whether the lock is ours now; None on a file system that has no locks."""
    try:
        fcntl.flock(file, kind)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _read(file: IO[str]) -> Holder | None:
    file.seek(0)
    try:
        return Holder(**json.loads(file.read()))
    except (ValueError, TypeError):
        return None


def _write(file: IO[str], content: str) -> None:
    file.seek(0)
    file.truncate()
    file.write(content)
    file.flush()
