"""What every script does the same way: show that it works in the folder, keep a log, end with one line on a failure.

What a job has made is sealed with its checksum; what it is made of must be as it was sealed.
"""

import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from reacher_shaping.jobs import folder_lock
from reacher_shaping.storage.files import check_seal, seal, seal_of


@contextmanager
def logged(job: Any) -> Iterator[Callable[[str], None]]:
    """Give a function that writes a line to the log; catch what a script raises, and tell it on the terminal too.

    job: Snakemake's own `snakemake` of the script.
    """
    path = Path(job.log[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    name = str(path.with_suffix("")).removeprefix("results/logs/")
    with path.open("w", buffering=1) as log, folder_lock.job(Path()):

        def say(line: str) -> None:
            print(line, file=log)

        def end(line: str, code: int) -> None:
            say(line)
            with suppress(OSError):  # the terminal may be gone
                print(f"[{name}] {line}", file=sys.stderr, flush=True)
            sys.exit(code)

        try:
            for file in filter(Path.is_file, map(Path, job.input)):
                if is_copy(file):
                    seal_of(file).unlink(missing_ok=True)  # of a copy that was here before
                else:
                    check_seal(file)
            yield say
            for file in filter(Path.is_file, map(Path, job.output)):
                if is_copy(file):
                    seal_of(file).unlink(missing_ok=True)
                else:
                    seal(file)
        except KeyboardInterrupt:
            end("stopped", 130)
        except Exception as error:
            traceback.print_exc(file=log)
            end(f"{type(error).__name__}: {error} (log: {path})", 1)


def is_copy(file: Path) -> bool:
    """Whether this machine has a file but for a job, from an object storage, whose checksum would not go with it."""
    return file.parts[:2] == (".snakemake", "storage")
