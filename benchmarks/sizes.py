"""How much is measured."""

from dataclasses import dataclass
from pathlib import Path

from reacher_shaping.settings.cell import Cell
from reacher_shaping.settings.study import load_study

CONFIG = Path(__file__).parents[1] / "config.yaml"
BLOCK = 10
"""Seeds of the block that the measures are stated for."""


@dataclass(frozen=True)
class Size:
    """How much is measured: all, or just enough to see that it runs."""

    repeats: int = 5
    seeds: tuple[int, ...] = (1, 2, 5, BLOCK, 20, 40)
    budgets: tuple[int, ...] = (1, 2, 4)  # iterations
    curve: tuple[int, ...] = (10, 30, 50)  # iterations after which the return is told
    chunks: int = 20  # of LANES_PER_SEED episodes: the 1000 of the study
    blocks: tuple[int, ...] = (1, 10, 100)  # per cell, for the dry run
    floor_begins: tuple[int, ...] = (0, 60)  # iterations before the floor is measured
    job_iterations: int = 3
    quick: bool = False

    @property
    def block(self) -> int:
        return BLOCK if BLOCK in self.seeds else self.seeds[-1]

    def cell(self, iterations: int = 10_000) -> Cell:
        """The first cell of the study with as many iterations as are asked for; small rollouts when quick."""
        cell = load_study(CONFIG).cells[0].model_dump()
        if self.quick:
            cell["protocol"]["ppo"] |= {"rollout_steps": 128, "epochs": 1}
        cell["budget"] = iterations * cell["protocol"]["ppo"]["rollout_steps"]
        return Cell.model_validate(cell)


QUICK_SIZE = Size(
    curve=(2, 3), repeats=1, seeds=(1, 2), budgets=(1, 2), chunks=1, blocks=(1,), floor_begins=(0, 3), quick=True
)
