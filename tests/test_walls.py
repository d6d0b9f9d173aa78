"""The walls between the package's rooms: imports run down only, and what a room must not know stays out of it."""

import ast
from graphlib import TopologicalSorter

import pytest
from rooms import FLOORS, MODULES, PAGE, inner_imports, outer_imports, room, with_drawing

IMPORTS = {name: inner_imports(path) for name, path in MODULES.items()}


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
    called = {node.attr for node in ast.walk(ast.parse(MODULES[module].read_text())) if isinstance(node, ast.Attribute)}
    assert not called & {"mean", "median", "quantile", "percentile", "std", "var", "sem", "corr", "cov"}


@pytest.mark.parametrize("module", MODULES)
def test_package_does_not_know_snakemake(module):
    assert "snakemake" not in outer_imports(MODULES[module])


def test_drawing_of_the_rooms_is_that_of_the_code():
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_drawing(page), "run `python workflow/rooms.py`"
