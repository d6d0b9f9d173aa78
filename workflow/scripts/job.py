"""What every script does the same way: show that it works in the folder, keep a log, end with one line on a failure."""

import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from reacher_shaping.jobs import folder_lock


@contextmanager
def logged(path: str) -> Iterator[Callable[[str], None]]:
    """Give a function that writes a line to the log; catch what a script raises, and tell it on the terminal too."""
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    name = str(Path(path).with_suffix("")).removeprefix("results/logs/")
    with Path(path).open("w", buffering=1) as log, folder_lock.job(Path()):

        def say(line: str) -> None:
            print(line, file=log)

        def end(line: str, code: int) -> None:
            say(line)
            with suppress(OSError):  # the terminal may be gone
                print(f"[{name}] {line}", file=sys.stderr, flush=True)
            sys.exit(code)

        try:
            yield say
        except KeyboardInterrupt:
            end("stopped", 130)
        except Exception as error:
            traceback.print_exc(file=log)
            end(f"{type(error).__name__}: {error} (log: {path})", 1)
