"""A cache for Snakemake where the home folder cannot be written, as in many containers."""

import os
from collections.abc import MutableMapping
from pathlib import Path


def ensure(environment: MutableMapping[str, str] = os.environ, instead: Path = Path("build/cache")) -> None:
    """Set `XDG_CACHE_HOME` to a folder that can be written: as it is, the home's `.cache`, or else `instead`."""
    usual = environment.get("XDG_CACHE_HOME") or Path(environment.get("HOME", "/"), ".cache")
    if not _writable(Path(usual)):
        instead.mkdir(parents=True, exist_ok=True)
        environment["XDG_CACHE_HOME"] = str(instead.absolute())


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)
