"""Notebooks run on a study's tables, define nothing, and come out the same twice."""

import ast
import json
import re
import shutil
from pathlib import Path

import jupytext
import nbformat
import numpy as np
import papermill
import pytest
import synthetic

from reacher_shaping.analysis import comparisons, learning_curves, single_seed_studies
from reacher_shaping.jobs import notebooks
from reacher_shaping.storage import schemas
from reacher_shaping.storage.files import write_table

SOURCES = sorted((Path(__file__).parents[2] / "workflow" / "notebooks").glob("*.py"))
IDS = [path.stem for path in SOURCES]

# Jupyter and papermill warn about their own surroundings, not about the notebooks.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    results = folder / "results"
    grid = synthetic.TOY_GRID
    write_table(results / "cells.parquet", synthetic.cells(grid, 2), schemas.CELLS)
    write_table(results / "runs.parquet", synthetic.runs(grid, 2), schemas.RUNS)
    lines = learning_curves.curve_table(synthetic.progress(grid, 2))
    write_table(results / "curves.parquet", lines, schemas.CURVES)
    write_table(results / "correlation.csv", synthetic.correlation(), schemas.CORRELATION)
    published = synthetic.correlation().assign(protocol="published")
    write_table(results / "correlation_published.csv", published, schemas.CORRELATION)
    write_table(results / "claims.csv", synthetic.claims(), schemas.CLAIMS)
    runs = synthetic.runs(grid, 2)
    write_table(results / "comparisons.parquet", comparisons.comparison_frame(runs), schemas.COMPARISONS)
    write_table(results / "variance.parquet", comparisons.variance_frame(runs), schemas.VARIANCE)
    power = comparisons.power_frame(runs, synthetic.published())
    write_table(results / "power.parquet", power, schemas.POWER)
    studies = single_seed_studies.single_seed_studies(runs, np.random.default_rng(0), 10)
    write_table(results / "lottery.csv", single_seed_studies.lottery_frame(studies), schemas.LOTTERY)
    write_table(results / "winners.csv", single_seed_studies.winners_frame(studies), schemas.WINNERS)
    write_table(results / "spread.csv", single_seed_studies.spread_frame(studies), schemas.SPREAD)
    radii, lengths = (synthetic.over(grid, 2, *more) for more in (("radius", (0.01, 0.02)), ("steps", (50, 100))))
    write_table(results / "radii.parquet", radii, schemas.RADII)
    write_table(results / "lengths.parquet", lengths, schemas.LENGTHS)
    (folder / "report" / "published").mkdir(parents=True)
    shutil.copy(synthetic.PUBLISHED.parent / "claims.yaml", folder / "report")
    for name in ("table2.csv", "table3.csv", "left_out.csv", "training_logs.csv"):
        (folder / "report" / "published" / name).write_bytes((synthetic.PUBLISHED / name).read_bytes())
    return folder


def test_there_are_notebooks():
    assert "story" in IDS


@pytest.mark.parametrize("source", SOURCES, ids=IDS)
def test_sources_define_nothing_and_say_their_language(source):
    tree = ast.parse(source.read_text(encoding="utf-8"))
    assert not [
        node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Lambda | ast.For)
    ]
    notebook = jupytext.read(source)
    assert notebook.metadata.kernelspec.language == "python"
    assert [cell for cell in notebook.cells if "parameters" in cell.metadata.get("tags", [])]


@pytest.mark.parametrize(("name", "figures"), [("correlation", 1), ("further_views", 5)])
def test_a_notebook_run_twice_gives_the_same_bytes_and_no_warning(study, monkeypatch, capfd, name, figures):
    monkeypatch.chdir(study)
    parameters = {"results": "results", "published": "report/published"}
    source = next(path for path in SOURCES if path.stem == name)
    outs = [Path("out") / f"{number}.ipynb" for number in (1, 2)]
    for out in outs:
        notebooks.execute(source, out, parameters)
    assert "WARNING" not in capfd.readouterr().err
    assert outs[0].read_bytes() == outs[1].read_bytes()
    text = outs[0].read_text(encoding="utf-8")
    assert str(study) not in text
    assert not re.search(r"/(home|root|tmp|work)/", text)
    notebook = nbformat.reads(text, as_version=4)
    nbformat.validate(notebook)
    shown = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert len([output for output in shown if "image/svg+xml" in output.get("data", {})]) == figures
    assert not [output for output in shown if output.output_type in ("error", "stream")]


def test_a_failing_notebook_raises_and_is_kept_for_reading(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source, log = Path("failing.py"), Path("logs") / "failing.ipynb"
    kernel = "#   kernelspec:\n#     display_name: Python 3\n#     language: python\n#     name: python3\n"
    header = f"# ---\n# jupyter:\n{kernel}# ---\n"
    source.write_text(header + '\n# %% tags=["parameters"]\nresults = "a"\n\n# %%\n1 / 0\n', encoding="utf-8")
    with pytest.raises(papermill.PapermillExecutionError, match="division"):
        notebooks.execute(source, Path("out.ipynb"), {"results": "b"}, log)
    assert "ZeroDivisionError" in log.read_text(encoding="utf-8")
    assert not Path("out.ipynb").exists()


def test_cleaning_drops_what_varies_and_nothing_else():
    cell = {"cell_type": "code", "id": "4f2a", "source": "1", "execution_count": 1}
    cell |= {"metadata": {"papermill": {"duration": 1.0}, "execution": {}, "tags": ["kept"]}, "outputs": []}
    notebook = nbformat.from_dict(
        {"cells": [cell], "metadata": {"papermill": {"start_time": "now"}, "kernelspec": {"name": "python3"},
         "language_info": {"name": "python", "version": "3.11.7"}}, "nbformat": 4, "nbformat_minor": 5}
    )  # fmt: skip
    cleaned = json.loads(json.dumps(notebooks.clean(notebook)))
    assert cleaned["metadata"] == {"kernelspec": {"name": "python3"}, "language_info": {"name": "python"}}
    assert cleaned["cells"][0] == cell | {"id": "cell-0", "metadata": {"tags": ["kept"]}}
