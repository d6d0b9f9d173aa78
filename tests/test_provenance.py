import pytest

from reacher_shaping import artifacts, provenance
from reacher_shaping.provenance import code_hash, git_state, machine, reachable_code, versions

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
    "shapes": """
        from reacher_shaping import numbers
        from reacher_shaping.numbers import double as twice

        class Square:
            def area(self, side):
                return numbers.other(side)

        class Line:
            def length(self, side):
                return twice(side)
    """,
    "meter": "def say(): return 1",
}
SCRIPT = """
from reacher_shaping import shapes
from reacher_shaping.meter import say

print(shapes.Line().length(3), say())
"""


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A small package in place of ours; gives a function that changes one of its files and hashes the script again."""
    import textwrap

    for name, text in MODULES.items():
        (tmp_path / f"{name}.py").write_text(textwrap.dedent(text))
    (tmp_path / "script.py").write_text(SCRIPT)
    monkeypatch.setattr(provenance, "_path", lambda module: tmp_path / f"{module}.py")

    def edited(name, old, new):
        path = tmp_path / f"{name}.py"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
        provenance._source.cache_clear()
        return code_hash(tmp_path / "script.py")

    edited.folder = tmp_path
    provenance._source.cache_clear()
    yield edited
    provenance._source.cache_clear()


def test_file_that_no_manifest_knows_names_the_manifest(tmp_path):
    (tmp_path / "policy.pt").write_text("weights")
    artifacts.write_json(tmp_path / "training.json", {"outputs": {"other.pt": "0"}})
    with pytest.raises(artifacts.ArtifactError, match=r"training\.json: has no checksum of policy\.pt; delete it"):
        provenance.unchanged(tmp_path / "policy.pt")


def test_only_definitions_that_are_reached_count(package):
    code = reachable_code(package.folder / "script.py")
    assert {name for name in code if not name.endswith(".")} == {
        "script",
        "shapes.Line",
        "numbers.double",
        "numbers._identity",
        "numbers.SCALE",
    }


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("numbers", "SCALE = 2", "SCALE = 4"),
        ("numbers", "return x", "return -x"),
        ("shapes", "twice(side)", "twice(-side)"),
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
        ("shapes", "numbers.other(side)", "0"),
        ("meter", "return 1", "return 2"),
        ("script", "print", "# a comment\nprint"),
    ],
)
def test_other_edits_leave_the_hash(package, name, old, new):
    assert package("script", "print", "print") == package(name, old, new)


def test_module_handed_on_as_a_value_counts_whole(package):
    package("script", "print(", "print(vars(shapes), ")
    assert {"shapes.Square", "numbers.other"} <= reachable_code(package.folder / "script.py").keys()


def test_state_of_a_folder_outside_git_is_unknown(tmp_path):
    assert git_state(tmp_path) == {"commit": None, "dirty": None}


def test_machine_and_versions_are_named():
    assert machine()["cpu"]
    assert machine()["cores"] >= 1
    assert {"python", "torch", "mujoco"} <= versions().keys()
