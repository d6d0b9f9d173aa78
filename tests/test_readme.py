"""The README: short, complete on its first screen, and every file it names is a link that leads somewhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
WRITTEN = re.sub(r"<!-- (reference|speed): begin -->.*?<!-- \1: end -->", "", README, flags=re.DOTALL)
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "config/README.md")),
    *sorted((ROOT / "docs").glob("*.md")),
]
WRITTEN_PAGES = [page for page in PAGES if page.name != "tables.md"]


def named(page):
    return str(page.relative_to(ROOT))


def test_what_is_written_by_hand_has_at_most_1200_words():
    assert len(WRITTEN.split()) <= 1200


def test_first_screen_has_the_commands():
    first = "\n".join(README.splitlines()[:25])
    assert all(f"make {target}" in first for target in ("reproduce", "test", "quick"))


def test_first_screen_leads_to_a_report_that_needs_no_building():
    first = "\n".join(README.splitlines()[:25])
    for target in ("report/site/report.pdf", "report/site/index.html"):
        assert f"]({target})" in first
        assert (ROOT / target).exists()


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert [target for target in targets if "://" not in target and not (page.parent / target).exists()] == []


LEFT_BY_RUNS = {".venv", "results/.checkpoints"}
"""Named in the pages, in a folder where something has run there too, and in no clone."""


@pytest.mark.parametrize("page", WRITTEN_PAGES, ids=named)
def test_files_are_named_as_links(page):
    text = re.sub(
        r"<!-- (\w+): begin -->.*?<!-- \1: end -->|```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL
    )
    found = re.findall(r"(?<!\[)`([\w./-]+)`", text)
    tracked = [name for name in found if ("/" in name or "." in name) and (ROOT / name).exists()]
    assert [name for name in tracked if name not in LEFT_BY_RUNS] == []


def test_every_make_target_that_is_named_exists():
    targets = set(re.findall(r"^([a-z_-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    assert set(re.findall(r"(?:`|^)make ([a-z_-]+)", WRITTEN, flags=re.MULTILINE)) <= targets
