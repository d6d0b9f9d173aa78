"""Every test of this folder runs the real workflow and is slow."""

from collections.abc import Callable
from pathlib import Path

import pytest
from project import Project, computed

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
LONGER = {
    "seeds": 2,
    "seeds_per_block": 1,
    "evaluation": {"episodes": 20, "radius": 0.02},
    "grid": [{"variants": ["l2"], "budgets": [61440]}],
}
"""Two blocks that train for seconds, so that there is time for a fault."""


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


@pytest.fixture(scope="session")
def longer() -> Callable[[Path], Project]:
    """Make a project, in a folder, of the study LONGER that keeps a checkpoint after every iteration."""

    def make(folder: Path) -> Project:
        project = Project(folder, LONGER)
        jobs = folder / "src/reacher_shaping/jobs/training_job.py"
        often = jobs.read_text().replace("SECONDS_PER_CHECKPOINT = 30.0", "SECONDS_PER_CHECKPOINT = 0.0")
        assert often != jobs.read_text()
        jobs.write_text(often)
        return project

    return make


@pytest.fixture(scope="session")
def longer_study(longer, tmp_path_factory) -> Project:
    """Its blocks and their table, made on one computer without a fault. Not to be changed: take a copy."""
    project = longer(tmp_path_factory.mktemp("longer"))
    project.run("--", "results/runs.parquet")
    return project


@pytest.fixture(scope="session")
def undisturbed(longer_study) -> dict[str, str]:
    """Checksums of what it computed."""
    found = computed(longer_study.folder)
    assert len(found) == 2 * 4 + 4
    return found
