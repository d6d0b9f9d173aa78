"""Run a notebook source to an executed notebook whose bytes depend only on what it shows.

    python -m reacher_shaping.jobs.notebooks SOURCE.py OUT.ipynb [--log FAILED.ipynb] [--NAME VALUE ...]

Each `--NAME VALUE` sets a parameter of the notebook. The notebook runs in the current folder, so paths given
relative to it stay relative in what the notebook shows.
"""

import argparse
import logging
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jupytext
import nbformat
import papermill
from nbconvert import HTMLExporter
from traitlets.config import Config

from reacher_shaping.storage.files import write_bytes, write_text

ENCRYPTED = Config({"KernelManager": {"transport_encryption": "auto"}})
"""A kernel warns of any plain connection, though none but its own machine can listen."""
# What varies between two executions of the same notebook.
VOLATILE = ("papermill", "execution", "jupytext", "widgets")


def clean(notebook: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """The notebook without times and paths of its execution, its cells numbered instead of given random ids."""
    for key in VOLATILE:
        notebook.metadata.pop(key, None)
    # The interpreter's patch version says nothing about the study.
    notebook.metadata.get("language_info", {}).pop("version", None)
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"
        for key in VOLATILE:
            cell.metadata.pop(key, None)
    return notebook


@contextmanager
def _no_personal_settings(folder: Path) -> Iterator[None]:
    """Meanwhile, kernels find no settings, start-up files or kernels of a person's: `folder` in place of the home's.

    IPython would run its start-up files first, and Matplotlib draw by the person's matplotlibrc.
    """
    names = ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "MPLCONFIGDIR")
    before = dict(os.environ)
    for name in [name for name in os.environ if name.startswith(("JUPYTER", "IPYTHON", "MPL", "MATPLOTLIB"))]:
        del os.environ[name]
    os.environ.update({name: str(folder / name.lower()) for name in names})
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def execute(
    source: Path, out: Path, parameters: dict[str, Any], log: Path | None = None, working_folder: Path | None = None
) -> None:
    """Execute the percent-format `source` with `parameters` in a folder and write the clean copy to `out`.

    A notebook that fails is kept, with its traceback, at `log`; the exception goes on to the caller.
    """
    with tempfile.TemporaryDirectory() as folder, _no_personal_settings(Path(folder)):
        prepared, executed = Path(folder) / "prepared.ipynb", Path(folder) / "executed.ipynb"
        nbformat.write(jupytext.read(source), prepared)  # type: ignore[no-untyped-call]
        try:
            papermill.execute_notebook(
                prepared,
                executed,
                parameters,
                log_output=False,
                progress_bar=False,
                cwd=working_folder or Path.cwd(),
                config=ENCRYPTED,
            )
        finally:
            if log is not None and executed.exists():
                write_bytes(log, executed.read_bytes())
        notebook = clean(nbformat.read(executed, as_version=4))  # type: ignore[no-untyped-call]
    write_text(out, nbformat.writes(notebook) + "\n")  # type: ignore[no-untyped-call]


def page(notebook: Path) -> str:
    """An executed notebook as one HTML file that needs no network."""
    exporter = HTMLExporter(mathjax_url="", require_js_url="", embed_images=True)  # type: ignore[no-untyped-call]
    content: str = exporter.from_filename(str(notebook))[0]
    return content


def main(arguments: list[str]) -> None:
    """Command line: source, output, and the notebook's parameters as `--name value`."""
    parser = argparse.ArgumentParser(description="Execute a notebook source.")
    parser.add_argument("source", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--log", type=Path)
    known, rest = parser.parse_known_args(arguments)
    if len(rest) % 2 or not all(name.startswith("--") for name in rest[::2]):
        parser.error(f"parameters come as --name value, got {' '.join(rest)}")
    parameters = {name[2:]: value for name, value in zip(rest[::2], rest[1::2], strict=True)}
    logging.getLogger("papermill").setLevel(logging.ERROR)
    execute(known.source, known.out, parameters, known.log)


if __name__ == "__main__":
    main(sys.argv[1:])
