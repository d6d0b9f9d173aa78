"""Every test of this folder runs the real workflow and is slow."""

from pathlib import Path

import pytest
from project import Project

TOY = {
    "seeds": 2,
    "seeds_per_block": 1,
    "evaluation": {"episodes": 20, "radius": 0.02},
    "grid": [
        {"group": "main", "variants": ["none"], "budgets": [2048]},
        {"group": "appendix", "variants": ["decay200k_l2sq"], "budgets": [2048], "alpha0": [0.5]},
    ],
}
"""Two cells of two blocks each."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def toy_study(tmp_path_factory) -> Project:
    """The study of TOY, run to the end. Not to be changed: take a copy."""
    project = Project(tmp_path_factory.mktemp("toy"), TOY)
    project.run()
    return project


@pytest.fixture(scope="session")
def toy_settings() -> dict:
    """What is laid over config.yaml for it."""
    return TOY


@pytest.fixture
def copy(toy_study, tmp_path) -> Project:
    """A copy of the toy study to change."""
    return toy_study.copied(tmp_path / "copy")
