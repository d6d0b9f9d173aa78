"""The catalogue of tables: what it says is what the rules, the kept files and the documentation have."""

import re
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from reacher_shaping.report import table_docs
from reacher_shaping.storage import tables

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "report" / "reference"
RULES = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk"))
CATALOGUE = [tables.BLOCK_TABLES, tables.TABLES]


def columns(path):
    if path.suffix == ".csv":
        return path.read_text(encoding="utf-8").partition("\n")[0].split(",")
    return pq.read_schema(path).names


def test_documentation_is_that_of_the_catalogue():
    written = (ROOT / "docs" / "tables.md").read_text(encoding="utf-8")
    assert written == table_docs.document(), "run python -m reacher_shaping.report.table_docs > docs/tables.md"


def test_rules_that_the_catalogue_names_are_there():
    rules = set(re.findall(r"^\s*(?:use )?rule (?:\w+ as )?(\w+)", RULES, flags=re.MULTILINE))
    named = {rule for part in CATALOGUE for entry in part.values() for rule in (entry.made_by, *entry.read_by)}
    assert named <= rules


def test_rules_take_the_study_wide_tables_from_the_catalogue():
    """No rule types the path of a table that the catalogue has, but for single inputs of a further study's rules."""
    typed = set(re.findall(r'"results/([\w/]+\.(?:parquet|csv))"', RULES))
    assert typed <= {"peers.parquet", "runs.parquet", "claims.csv"}  # asked for being there before there are rules


@pytest.mark.parametrize(
    "path", [path.relative_to(KEPT).as_posix() for path in KEPT.glob("**/*") if path.suffix in (".parquet", ".csv")]
)
def test_kept_tables_are_in_the_catalogue_and_every_column_has_a_meaning(path):
    inside = path.startswith("experiments/")
    files = {entry.file: entry for entry in tables.TABLES.values()}
    entry = files[path.split("/", 2)[2] if inside else path]
    assert entry.of != ("main" if inside else "further")
    for column in columns(KEPT / path):
        assert column in entry.schema.columns or entry.schema.measures
        assert table_docs.meaning(column)


def test_a_column_without_a_meaning_is_an_error():
    with pytest.raises(KeyError, match=r"columns\.yaml does not say what no_such_measure means"):
        table_docs.meaning("no_such_measure")
    assert table_docs.meaning("deterministic_success_rate_low").endswith("lower limit of the 95 % interval of the mean")


def test_reading_and_making_follow_the_catalogue():
    assert tables.made_by("compare_runs", "results/{folder}") == {
        "comparisons": "results/{folder}comparisons.parquet",
        "correlation": "results/{folder}correlation.csv",
    }
    assert "peers" not in tables.of_study({"further", "peers"})
    assert "agreement" in tables.of_study({"further", "peers"})
