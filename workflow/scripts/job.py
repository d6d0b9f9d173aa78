"""What every script does the same way: keep a log, and end with one line and the log's name if something fails."""

import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def logged(path: str) -> Iterator[Callable[[str], None]]:
    """Give a function that writes a line to the log and to the terminal; catch what a script raises."""
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    name = str(Path(path).with_suffix("")).removeprefix("results/logs/")
    with Path(path).open("w", buffering=1) as log:

        def say(line: str) -> None:
            print(line, file=log)
            print(f"[{name}] {line}", file=sys.stderr, flush=True)

        try:
            yield say
        except Exception as error:
            traceback.print_exc(file=log)
            say(f"{type(error).__name__}: {error} (log: {path})")
            sys.exit(1)
