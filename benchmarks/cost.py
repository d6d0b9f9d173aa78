"""The cost of a study in core seconds, from its cells, seeds and steps and the rates of one core (docs/cost.md)."""

from dataclasses import dataclass

from reacher_shaping.settings.study import Study
from reacher_shaping.tasks.reacher import TASK

MODES = 2  # stochastic and deterministic evaluation


@dataclass(frozen=True)
class Rates:
    """Speed of one core: environment steps per second, and seconds before a job's first step."""

    training: float
    evaluation: float
    start: float


@dataclass(frozen=True)
class Cost:
    """Environment steps of training, seconds of one core for all jobs, and of the longest chain of jobs."""

    env_steps: int
    core_seconds: float
    longest_job: float


def study(settings: Study, *, seeds: int, seeds_per_block: int, rates: Rates) -> Cost:
    """Return the cost of training and evaluating `seeds` seeds of every cell."""
    full, rest = divmod(seeds, seeds_per_block)
    blocks = [seeds_per_block] * full + [rest] * (rest > 0)
    episodes = MODES * settings.evaluation.episodes
    steps = [cell.iterations * cell.protocol.ppo.rollout_steps for cell in settings.cells]
    chains = [
        2 * rates.start + size * (budget / rates.training + episodes * TASK.episode_steps / rates.evaluation)
        for budget in steps
        for size in blocks
    ]
    return Cost(seeds * sum(steps), sum(chains), max(chains))
