"""The project's folder and the settings of its study, for the commands beside Snakemake."""

import signal
import sys
from pathlib import Path

from reacher_shaping.settings.base import ConfigError
from reacher_shaping.settings.study import Study, load_study, read_settings

HERE = Path(__file__).resolve().parents[1]


def study(*overlays: Path) -> Study:
    """The study of config.yaml, with other files laid over it as `snakemake --configfile` does.

    Ends the process with one line where they say what is not allowed.
    """
    try:
        return load_study(read_settings(HERE / "config.yaml", *overlays))
    except ConfigError as error:
        sys.exit(f"ConfigError: {error}")


def end_with_reader() -> None:
    """Let the process end in silence where its output is no longer read, as by `| head`."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
