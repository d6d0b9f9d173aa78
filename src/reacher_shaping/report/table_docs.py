"""The dictionary of tables, `docs/tables.md`, from the catalogue and the meanings of the columns.

python -m reacher_shaping.report.table_docs > docs/tables.md
"""

import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from reacher_shaping.report.text import entry, say
from reacher_shaping.storage import tables

COLUMNS = Path(tables.__file__).with_name("columns.yaml")
PLACES = ((tables.BLOCK_TABLES, "block"), (tables.TABLES, "study"))


@cache
def meanings() -> Mapping[str, Any]:
    """The file of meanings: `every` column, and families by how names begin and end."""
    content: Mapping[str, Any] = yaml.safe_load(COLUMNS.read_text(encoding="utf-8"))
    return content


def meaning(column: str) -> str:
    """What a column holds, with its unit. Raises KeyError where the file of meanings does not know it."""
    known = meanings()
    if column in known["every"]:
        return str(known["every"][column])
    for end, text in known["ends"].items():
        if column.endswith(end):
            return f"{meaning(column.removesuffix(end))}: {text}"
    for begin, text in known["begins"].items():
        if column.startswith(begin):
            rest = column.removeprefix(begin)
            return f"{known['every'][rest]}: {text}" if rest in known["every"] else str(text)
    raise KeyError(f"{COLUMNS.name} does not say what {column} means")


def document() -> str:
    """The whole page as Markdown."""
    parts = [f"# {say('table_docs.title')}", say("table_docs.intro")]
    for catalogue, place in PLACES:
        parts += [f"## {say(f'table_docs.{place}')}", *(_section(name, one) for name, one in catalogue.items())]
    parts += [f"## {say('table_docs.measures')}", say("table_docs.measures_intro")]
    parts.append(_rows([(name, "", str(text)) for name, text in meanings()["every"].items()]))
    families = [
        *((f"{begin}…", "", str(text)) for begin, text in meanings()["begins"].items()),
        *((f"…{end}", "", str(text)) for end, text in meanings()["ends"].items()),
    ]
    parts.append(_rows(families))
    return "\n\n".join(parts) + "\n"


def _section(name: str, table: tables.Entry) -> str:
    about = say(
        "table_docs.about",
        file=table.file,
        row=table.row,
        made_by=table.made_by,
        read_by=", ".join(f"`{rule}`" for rule in table.read_by) or say("table_docs.nobody"),
    )
    if table.of:
        about += f" {say('table_docs.of', kind=say(f'table_docs.kinds.{table.of}'))}"
    rows = [(column, kind, meaning(column)) for column, kind in table.schema.columns.items()]
    more = f"\n\n{say('table_docs.more')}" if table.schema.measures else ""
    return f"### {name}\n\n{about}\n\n{_rows(rows)}{more}"


def _rows(rows: list[tuple[str, str, str]]) -> str:
    lines = ["| " + " | ".join(entry("table_docs.headings")) + " |", "|:--|:--|:--|"]
    return "\n".join([*lines, *(f"| `{column}` | {kind} | {text} |" for column, kind, text in rows)])


if __name__ == "__main__":
    sys.stdout.write(document())
