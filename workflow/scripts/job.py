"""What every script does the same way: show that it works in the folder, keep a log, end with one line on a failure.

What a job has made is sealed with its checksum; what it is made of must be as it was sealed.
"""

import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from reacher_shaping.jobs import folder_lock
from reacher_shaping.storage.files import check_seal, seal


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
            for file in on_disk(job.input):
                check_seal(file)
            yield say
            for file in on_disk(job.output):
                seal(file)
        except KeyboardInterrupt:
            end("stopped", 130)
        except Exception as error:
            traceback.print_exc(file=log)
            end(f"{type(error).__name__}: {error} (log: {path})", 1)


def on_disk(files: Iterable[str]) -> list[Path]:
    """The files among these that lie in the study's folder: of an object storage this machine has but a copy."""
    paths = map(Path, files)
    return [path for path in paths if path.is_file() and path.parts[:2] != (".snakemake", "storage")]
