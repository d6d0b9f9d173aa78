"""The walls between the package's rooms: imports run down only, and what a room must not know stays out of it."""

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "reacher_shaping"
FLOORS = [
    "cli",
    "report",
    "figures",
    "analysis",
    "jobs",
    "evaluation",
    "training",
    "tasks",
    "settings",
    "storage",
    "ground",
]
"""The rooms from top to bottom; `ground` are the modules that stand in no folder."""
MODULES = {
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts): path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path.name != "__init__.py"
}


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """(module, name) of each import of a file; the name is empty where a module is imported whole."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module or "", alias.name) for alias in node.names)


def inner_imports(path: Path) -> set[str]:
    """Modules of the package that a file imports, by their names below it."""
    found = set()
    for module, name in imports(path):
        if module.split(".")[0] == "reacher_shaping":
            inner = module.removeprefix("reacher_shaping").removeprefix(".")
            whole = f"{inner}.{name}".strip(".")
            found.add(whole if whole in MODULES else inner)
    return found & MODULES.keys()


def outer_imports(path: Path) -> set[str]:
    """Top-level names of what else a file imports."""
    return {module.split(".")[0] for module, _ in imports(path)} - {"reacher_shaping"}


IMPORTS = {name: inner_imports(path) for name, path in MODULES.items()}


def room(module: str) -> str:
    if module == "cli":
        return "cli"
    return module.split(".")[0] if "." in module else "ground"


def in_room(*rooms: str) -> list[str]:
    return [name for name in MODULES if room(name) in rooms]


def test_every_module_stands_in_a_known_room():
    assert {room(name) for name in MODULES} == set(FLOORS)


@pytest.mark.parametrize("module", MODULES)
def test_imports_run_down(module):
    above = FLOORS[: FLOORS.index(room(module))]
    assert not {other for other in IMPORTS[module] if room(other) in above}


def test_no_import_goes_round():
    assert len(list(TopologicalSorter(IMPORTS).static_order())) == len(MODULES)


@pytest.mark.parametrize("module", in_room("training"))
def test_training_reads_and_writes_no_file(module):
    assert not IMPORTS[module] & {"storage.files", "storage.policy_format", "storage.provenance"}
    assert not outer_imports(MODULES[module]) & {"pathlib", "os", "io", "logging", "matplotlib", "seaborn"}


@pytest.mark.parametrize("module", in_room("settings"))
def test_settings_load_nothing_heavy(module):
    assert not outer_imports(MODULES[module]) & {"numpy", "torch", "pandas", "scipy", "mujoco", "matplotlib", "pyarrow"}


@pytest.mark.parametrize("module", [name for name in MODULES if room(name) not in ("jobs", "cli")])
def test_only_workflow_benchmarks_and_command_line_know_of_jobs(module):
    assert not {other for other in IMPORTS[module] if room(other) == "jobs"}


@pytest.mark.parametrize("module", in_room("figures", "report"))
def test_what_is_shown_is_computed_elsewhere(module):
    assert "scipy" not in outer_imports(MODULES[module])
    assert "stats" not in IMPORTS[module]


@pytest.mark.parametrize("module", MODULES)
def test_package_does_not_know_snakemake(module):
    assert "snakemake" not in outer_imports(MODULES[module])
