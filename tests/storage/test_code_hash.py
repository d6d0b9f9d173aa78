"""The tracer on a small package with sub-packages: what an edit reruns, and what it does not."""

import shutil
import textwrap
from pathlib import Path

import pytest
from cells import cell

from reacher_shaping.storage import code_hash as tracer
from reacher_shaping.storage.code_hash import code_hash, reachable_code, reached_files

MODULES = {
    "numbers": """
        import math
        from scipy import stats

        SCALE = 2
        UNUSED = 3

        def double(x):
            \"\"\"Twice x.\"\"\"
            # a comment
            return SCALE * _identity(x)

        def _identity(x):
            return x

        def other(x):
            return math.floor(x + UNUSED)
    """,
    "plane/shapes": """
        from reacher_shaping import numbers
        from reacher_shaping.numbers import double as twice

        class Square:
            def area(self, side):
                return numbers.other(side)

        class Line:
            def length(self, side):
                return twice(side)
    """,
    "plane/__init__": "",
    "jobs/progress": "def say(): return 1",
}
SCRIPT = """
from reacher_shaping.plane import shapes
from reacher_shaping.jobs.progress import say

print(shapes.Line().length(3), say())
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A small package in place of ours; gives a function that changes one of its files and hashes the script again."""
    for name, text in MODULES.items():
        path = tmp_path / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(textwrap.dedent(text))
    (tmp_path / "script.py").write_text(SCRIPT)
    monkeypatch.setattr(tracer, "FOLDER", tmp_path)

    def edited(name, old, new):
        path = tmp_path / f"{name}.py"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
        tracer._source.cache_clear()
        return code_hash(tmp_path / "script.py")

    edited.folder = tmp_path
    tracer._source.cache_clear()
    yield edited
    tracer._source.cache_clear()


def test_only_definitions_that_are_reached_count(package):
    code = reachable_code(package.folder / "script.py")
    assert {name for name in code if not name.endswith(":")} == {
        "script",
        "plane.shapes:Line",
        "numbers:double",
        "numbers:_identity",
        "numbers:SCALE",
    }


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("numbers", "SCALE = 2", "SCALE = 4"),
        ("numbers", "return x", "return -x"),
        ("plane/shapes", "twice(side)", "twice(-side)"),
        ("script", "length(3)", "length(4)"),
    ],
)
def test_edit_of_reached_code_changes_the_hash(package, name, old, new):
    assert package("script", "print", "print") != package(name, old, new)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("numbers", "# a comment", "# another"),
        ("numbers", "Twice x.", "Two times x."),
        ("numbers", "SCALE * _identity(x)", "(\n        SCALE * _identity(x)\n    )"),
        ("numbers", "UNUSED = 3", "UNUSED = 4"),
        ("numbers", "math.floor(x + UNUSED)", "0"),
        ("plane/shapes", "numbers.other(side)", "0"),
        ("jobs/progress", "return 1", "return 2"),
        ("script", "print", "# a comment\nprint"),
    ],
)
def test_other_edits_leave_the_hash(package, name, old, new):
    assert package("script", "print", "print") == package(name, old, new)


def test_module_handed_on_as_a_value_counts_whole(package):
    package("script", "print(", "print(vars(shapes), ")
    assert {"plane.shapes:Square", "numbers:other"} <= reachable_code(package.folder / "script.py").keys()


def test_reached_files_are_those_of_the_definitions_that_count(package):
    paths = reached_files(package.folder / "script.py")
    assert [str(path.relative_to(package.folder)) for path in paths] == ["script.py", "numbers.py", "plane/shapes.py"]


@pytest.mark.parametrize(
    "statement",
    [
        "from reacher_shaping.plane.shapes import Line",
        "import reacher_shaping.plane.shapes as shapes; Line = shapes.Line",
        "from reacher_shaping.plane import shapes; Line = shapes.Line",
    ],
)
def test_every_way_of_importing_from_a_sub_package_is_followed(package, statement):
    (package.folder / "other.py").write_text(f"{statement}\nLine().length(1)\n")
    assert {"plane.shapes:Line", "numbers:double"} <= reachable_code(package.folder / "other.py").keys()


@pytest.mark.parametrize("statement", ["from .plane import shapes", "import reacher_shaping.plane.shapes"])
def test_import_that_cannot_be_followed_is_refused(package, statement):
    (package.folder / "other.py").write_text(f"{statement}\n")
    with pytest.raises(ValueError, match=r"plane.*: write `from reacher_shaping\.\.\. import "):
        code_hash(package.folder / "other.py")


@pytest.fixture
def copied(tmp_path, monkeypatch):
    """A copy of the package; gives a function that hashes the training of a variant's cells."""
    shutil.copytree(tracer.FOLDER, tmp_path / "package", ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(tracer, "FOLDER", tmp_path / "package")
    script = Path(__file__).parents[2] / "workflow" / "scripts" / "train_block.py"

    def hashes():
        tracer._source.cache_clear()
        return {name: code_hash(script, cell(name).chosen_code) for name in ("none", "l2", "l2sq", "decay")}

    hashes.folder = tmp_path / "package"
    yield hashes
    tracer._source.cache_clear()


@pytest.mark.parametrize(
    ("file", "old", "new", "changed"),
    [
        ("training/potentials.py", "\n\ndef l2sq", "\n\ndef exp(d):\n    return np.exp(-d)\n\n\ndef l2sq", set()),
        ("training/schedules.py", "\n\nconstant = ", "\n\nhalf = _stateless(lambda v, t: t)\nconstant = ", set()),
        (
            "training/schedules.py",
            "\n\nconstant = ",
            "\n\nslow = _stateless(lambda v, t: t / v.horizon)\nconstant = ",
            set(),
        ),
        ("tasks/other.py", "", "TASK = 1\n", set()),
        ("training/potentials.py", "np.negative(np.square(distance))", "-distance * distance", {"l2sq"}),
        ("training/schedules.py", "1.0 - env_steps", "2.0 - env_steps", {"decay"}),
        ("tasks/reacher.py", "frame_skip=2", "frame_skip=3", {"none", "l2", "l2sq", "decay"}),
    ],
    ids=[
        "potential_added",
        "schedule_added",
        "schedule_of_a_horizon_added",
        "task_added",
        "potential",
        "schedule",
        "task",
    ],
)
def test_a_cells_training_follows_its_own_potential_schedule_and_task(copied, file, old, new, changed):
    before = copied()
    path = copied.folder / file
    text = path.read_text() if path.exists() else ""
    assert old in text
    path.write_text(text.replace(old, new) if old else new)
    after = copied()
    assert {name for name in before if before[name] != after[name]} == changed


def test_the_names_that_settings_allow_are_those_of_the_code(copied):
    assert tracer.defined_names("training.potentials")[:3] == ("none", "l2", "l2sq")
    tasks = tracer.modules_defining("tasks", "TASK")
    assert {"fetch_reach", "pusher", "reacher"} <= set(tasks)
    (copied.folder / "training/potentials.py").write_text("A = 1\n_B = 2\n\n\ndef c():\n    pass\n")
    (copied.folder / "tasks/toy.py").write_text("TASK = 1\n")
    tracer._source.cache_clear()
    assert tracer.defined_names("training.potentials") == ("A", "c")
    assert set(tracer.modules_defining("tasks", "TASK")) == {*tasks, "toy"}


def test_a_name_reads_what_its_own_code_or_what_it_calls_in_its_module_reads(copied):
    lines = [
        "def _a(v): return v.rate",
        "def _b(v): return _a(v) + _b(v)",
        "x = f(_b)",
        "y = f(lambda v: v.other)",
        "z = 1",
    ]
    (copied.folder / "training/potentials.py").write_text("\n".join(lines))
    tracer._source.cache_clear()
    assert tracer.names_reading("training.potentials", "rate") == ("x",)
    assert tracer.names_reading("training.potentials", "other") == ("y",)


def test_a_chosen_name_that_is_not_defined_is_refused(package):
    with pytest.raises(ValueError, match="numbers:nothing is not defined"):
        code_hash(package.folder / "script.py", ("numbers:nothing",))
