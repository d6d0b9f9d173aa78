"""A copy of the project to run the real workflow on."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from reacher_shaping.settings.study import read_settings
from reacher_shaping.storage.files import sha256

ROOT = Path(__file__).parents[1]


class Project:
    """A copy of the project in `folder`, with `changes` laid over its config.yaml.

    `environment` are variables that its commands have besides those of the tests, None for one that they have not.
    """

    def __init__(self, folder: Path, changes: Mapping[str, Any]):
        self.folder, self.environment = folder, dict[str, str | None]()
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("Snakefile", "profiles", "workflow", "src", "report", "config.yaml"):
            place, ignored = ROOT / name, shutil.ignore_patterns("__pycache__", "*.egg-info", "report.html")
            copy = shutil.copytree if place.is_dir() else shutil.copy
            copy(place, folder / name, **({"ignore": ignored} if place.is_dir() else {}))
        config = read_settings(folder / "config.yaml") | changes
        (folder / "config.yaml").write_text(yaml.safe_dump(config, sort_keys=False))

    def copied(self, folder: Path) -> "Project":
        """A copy of all that is there by now."""
        shutil.copytree(self.folder, folder)
        project = object.__new__(Project)
        project.folder, project.environment = folder, {}
        return project

    def start(self, *arguments: str) -> subprocess.Popen:
        """Start Python on the copy, in a process group of its own."""
        wanted = {"PYTHONPATH": str(self.folder / "src")} | self.environment
        environment = {name: value for name, value in (os.environ | wanted).items() if value is not None}
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        command = [sys.executable, *arguments]
        # What a shell runs in the background ignores Ctrl-C, and so would all it starts.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        return subprocess.Popen(command, cwd=self.folder, env=environment, start_new_session=True, **streams)

    def python(self, *arguments: str) -> subprocess.CompletedProcess:
        started = self.start(*arguments)
        out, err = started.communicate(timeout=3600)
        return subprocess.CompletedProcess(arguments, started.returncode, out, err)

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess:
        return self.python("-m", "snakemake", *arguments)

    def run(self, *arguments: str) -> None:
        done = self.snakemake(*arguments)
        assert done.returncode == 0, done.stderr[-6000:]

    def planned(self, *arguments: str) -> dict[str, list[str]]:
        """Rules that a dry run would execute, each with the outputs of its jobs."""
        done = self.snakemake("--quiet", "host", "--dry-run", *arguments)
        assert done.returncode == 0, done.stderr[-6000:]
        jobs: dict[str, list[str]] = {}
        for rule, outputs in re.findall(
            r"^ *(?:local)?rule (\w+):\n(?: +input: .*\n)? +output: (.*)$", done.stdout, re.MULTILINE
        ):
            jobs.setdefault(rule, []).extend(outputs.split(", "))
        return jobs

    @contextmanager
    def edited(self, name: str, old: str, new: str) -> Iterator[None]:
        path = self.folder / name
        text = path.read_text()
        assert old in text, f"{name} has no {old!r}"
        with self.replaced(name, text.replace(old, new, 1)):
            yield

    @contextmanager
    def configured(self, **changes) -> Iterator[None]:
        config = read_settings(self.folder / "config.yaml") | changes
        with self.replaced("config.yaml", yaml.safe_dump(config, sort_keys=False)):
            yield

    @contextmanager
    def replaced(self, name: str, text: str) -> Iterator[None]:
        path = self.folder / name
        before = path.read_text()
        path.write_text(text)
        try:
            yield
        finally:
            path.write_text(before)


def computed(folder: Path) -> dict[str, str]:
    """Checksums of what the study in `folder` computed: the files under results/ but those that tell times."""
    results = folder / "results"
    files = [path for path in results.rglob("*") if path.is_file() and path.suffix in {".pt", ".parquet", ".csv"}]
    return {str(path.relative_to(results)): sha256(path) for path in files if "/." not in str(path)}
