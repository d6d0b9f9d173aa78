"""The words stand in one file: what is asked for is there, what is there is asked for, and no hole stays open."""

import ast
import re
from pathlib import Path

import pytest

from reacher_shaping.report import captions, text
from reacher_shaping.settings.outputs import VIEWS

ROOT = Path(__file__).parents[2]
REPORT = ROOT / "src" / "reacher_shaping" / "report"


def test_asking_for_words_that_are_not_there_is_an_error():
    with pytest.raises(KeyError, match=r"text\.yaml has no captions\.figure_9"):
        text.say("captions.figure_9")
    with pytest.raises(KeyError, match=r"text\.yaml has no titles\.no_such_figure"):
        captions.title("no_such_figure")


def test_a_hole_that_nothing_fills_is_an_error():
    with pytest.raises(KeyError, match=r"nothing fills \{count\} of first\.times"):
        text.say("first.times")


def test_every_view_of_a_study_has_a_title_and_a_caption():
    assert set(text.entry("views")) == set(VIEWS)
    assert all(words.keys() >= {"title", "caption"} for words in text.entry("views").values())


def test_every_title_has_a_caption():
    assert text.entry("titles").keys() == text.entry("captions").keys()


def test_every_text_that_code_names_is_there():
    named = set()
    for path in REPORT.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in ("say", "entry"):
                first = node.args[0]
                named |= {first.value} if isinstance(first, ast.Constant) else set()
    assert len(named) > 50
    for name in named:
        text.entry(name)


def test_words_stand_in_no_module_of_the_report():
    """A text of four words or more that a reader would see is in the file of words, not in code."""
    for path in REPORT.glob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        documented = {
            id(node.body[0].value)
            for node in ast.walk(tree)
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node)
        }
        raised = {id(inner) for node in ast.walk(tree) if isinstance(node, ast.Raise) for inner in ast.walk(node)}
        found = [
            node.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in documented | raised
            and len(re.findall(r"[A-Za-z]{2,}", node.value)) > 3
            and " " in node.value.strip()
            and "<" not in node.value
            and "svg" not in node.value
            and '="' not in node.value
        ]
        assert not found, path.name
