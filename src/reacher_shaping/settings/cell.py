"""One cell: everything that determines the training of its runs, and what each setting may be.

Unknown keys and impossible values are refused. The module imports neither torch nor numpy, so that Snakemake builds its
graph of jobs fast.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from reacher_shaping.settings.base import WHOLE, Count, Fraction, Name, NonNegative, Positive, Seed, Settings, plain
from reacher_shaping.storage.code_hash import defined_names, modules_defining, names_reading

Alpha0 = Annotated[float, Field(ge=1e-6, le=1e6)]
"""The shaping weight at t = 0, without unit; bounded because it names the cell's folder in plain digits."""

if TYPE_CHECKING:
    TaskName = str
    PotentialName = str
    ScheduleName = str
else:  # what there is, read from the code without running it
    TaskName = Literal[modules_defining("tasks", "TASK")]
    PotentialName = Literal[defined_names("training.potentials")]
    ScheduleName = Literal[defined_names("training.schedules")]


SCHEDULES_OF = {name: names_reading("training.schedules", name) for name in ("horizon", "rate")}
"""Schedules that need a setting of the variant: those whose code reads it."""
LEARNED = names_reading("training.potentials", "rate")
"""Potentials that are learned, by a rate."""


REACHERS = ("reacher", "reacher_closed_form")
"""Tasks that are Gymnasium's Reacher, whatever steps it."""


class Environment(Settings):
    """The task and its reward, the weight of the control cost, and whether actions are clipped."""

    task: TaskName = "reacher"
    """What is simulated, observed and rewarded; a file of `tasks/`."""
    reward: Literal["dense", "sparse"] = "dense"
    """Less the distance to the goal, or 1 within `success_radius` of it; both less the control cost."""
    success_radius: Positive | None = None
    """Distance to the goal in m that counts as success; without it 0.02 in training, else the evaluation's `radius`."""
    control_weight: NonNegative = 0.1
    """Reward taken per squared unit of action."""
    clip_actions: bool = False
    """Whether actions are clipped to the task's limit, 1 for Reacher, before they are applied and charged."""

    def radius(self, default: float) -> float:
        """Return the distance to the goal in m that counts as success, where `default` is the evaluation's."""
        return self.success_radius or default


class PPO(Settings):
    """Proximal policy optimisation (Schulman et al. 2017); the defaults are the paper's, as in config.yaml."""

    learning_rate: Positive = 3e-4
    """Step size of Adam."""
    learning_rate_schedule: Literal["constant", "linear"] = "constant"
    """`linear` goes down to 0 at the end of the budget."""
    discount: Annotated[float, Field(gt=0, le=1)] = 0.99
    """Gamma, per environment step."""
    gae_lambda: Fraction = 0.95
    """Lambda of generalised advantage estimation."""
    clip_range: Positive = 0.2
    """How far the probability ratio may be from 1 before it is clipped."""
    ratio_pairs: Literal["sample", "minibatch"] = "sample"
    """Ratios of new and old probability of the same `sample`, or of all pairs of a `minibatch`."""
    advantage_normalisation: Literal["rollout", "minibatch"] = "rollout"
    """Advantages to mean 0 and deviation 1 over a rollout, or again in every minibatch."""
    minibatch_size: Count = 64
    """Environment steps of a minibatch; divides `rollout_steps`."""
    rollout_steps: Annotated[int, Field(ge=2, le=10**6), WHOLE] = 2048
    """Environment steps of an iteration, after a fresh reset; 2048 are 40 episodes of 50 and one of 48."""
    epochs: Annotated[int, Field(ge=1, le=1000), WHOLE] = 10
    """Passes over a rollout."""
    value_coefficient: NonNegative = 0.5
    """Weight of the squared value error in the loss."""
    entropy_coefficient: NonNegative = 0.01
    """Weight of the entropy bonus."""
    max_gradient_norm: Positive = 0.5
    """Greatest norm of the gradient over all parameters of a run."""
    adam_epsilon: Positive = 1e-8
    """Added to Adam's denominator."""
    hidden_units: Annotated[int, Field(ge=1, le=4096), WHOLE] = 64
    """Units of each of two Tanh layers."""
    networks: Literal["shared", "separate"] = "shared"
    """One trunk `shared` by policy and value, or one each: `separate`."""
    initialisation: Literal["default", "orthogonal"] = "default"
    """First weights: PyTorch's `default`, or `orthogonal`."""
    initial_log_std: float = 0.0
    """Logarithm of the torques' standard deviation at the start."""

    @property
    def towers(self) -> int:
        """Trunks of a network: one for policy and value together, or one each."""
        return 2 if self.networks == "separate" else 1

    @model_validator(mode="after")
    def _minibatches_fill_the_rollout(self) -> Self:
        if self.rollout_steps % self.minibatch_size:
            raise ValueError(f"minibatch_size = {self.minibatch_size} must divide rollout_steps = {self.rollout_steps}")
        if self.advantage_normalisation == "minibatch" and self.minibatch_size < 2:
            raise ValueError(
                f"minibatch_size = {self.minibatch_size} has no deviation to normalise by; allowed: >= 2, or "
                "advantage_normalisation = 'rollout'"
            )
        return self


class Shaping(Settings):
    """How the shaping reward is formed, and what holds at the last step of an episode."""

    form: Literal["paper", "dynamic", "hurl"] = "paper"
    """`paper`: alpha(t) (gamma Phi(s') - Phi(s)); `dynamic`: with the weight inside the difference; `hurl`: the
    potential as a guess of the value, under a shorter horizon (Cheng et al. 2021)."""
    mixing: Fraction = 0.1
    """Share of the guess in `hurl` at t = 0, where the discount is gamma (1 - mixing); the schedule takes it to 0."""
    episode_end: Literal["terminal", "bootstrap"] = "terminal"
    """The value after an episode's last step: 0 (`terminal`), or the critic's (`bootstrap`)."""
    terminal_potential: Literal["keep", "zero"] = "keep"
    """The potential after an episode's last step, kept or zero."""
    decay_potential: Literal["variant", "l2sq"] = "variant"
    """Of a variant whose weight decays: the variant's own, or `l2sq` whatever it says."""
    start_weight: Literal["alpha0", "one"] = "alpha0"
    """The weight at t = 0: alpha0, or one whatever alpha0 says."""


class Log(Settings):
    """What the protocol's own training log shows, in the column `logged_return`; nothing learns from it."""

    episode_return: Literal["unshaped", "released"] = "unshaped"
    """Mean over a rollout's episodes (`unshaped`), or as the released code logs it (`released`)."""


class Protocol(Settings):
    """A named, complete set of environment and algorithm choices."""

    name: Name
    environment: Environment = Environment()
    """What surrounds the simulation."""
    ppo: PPO = PPO()
    """The algorithm."""
    shaping: Shaping = Shaping()
    """The shaping reward."""
    log: Log = Log()
    """The protocol's own training log."""

    @model_validator(mode="after")
    def _sparse_is_not_dense_by_a_leak(self) -> Self:
        shaping = self.shaping
        leaks = shaping.episode_end == "terminal" and shaping.terminal_potential == "keep"
        if self.environment.reward == "sparse" and leaks:
            raise ValueError(
                "shaping.terminal_potential = 'keep' with episode_end = 'terminal' leaves the last potential in the "
                "return, a dense reward under environment.reward = 'sparse'; allowed: terminal_potential = 'zero', or "
                "episode_end = 'bootstrap'"
            )
        return self


class Variant(Settings):
    """One shaping rule: a potential and the schedule of its weight."""

    name: Name
    potential: PotentialName
    """Phi, a function of the goal distance in m."""
    schedule: ScheduleName = "constant"
    """The weight stays, or goes down in a line to 0 at `horizon`."""
    horizon: Count | None = None
    """Environment steps until a decay is at 0, or at 1 / e where it is exponential."""
    rate: Annotated[float, Field(gt=0, le=1)] | None = None
    """How far an adaptive weight, or a learned potential, moves in an iteration."""

    @model_validator(mode="after")
    def _schedule_is_complete(self) -> Self:
        schedule, potential = f"schedule = {self.schedule!r}", f"potential = {self.potential!r}"
        needs = {name: [schedule] * (self.schedule in names) for name, names in SCHEDULES_OF.items()}
        needs["rate"] += [potential] * (self.potential in LEARNED)
        units = {"horizon": "a number of environment steps >= 1", "rate": "a number in (0, 1]"}
        for name, needed in needs.items():
            value = getattr(self, name)
            if needed and value is None:
                raise ValueError(f"{name} is missing; {needed[0]} needs {units[name]}")
            if not needed and value is not None:
                raise ValueError(f"{name} = {value} has no meaning with {schedule}; leave it out")
        if (self.name == "none") != (self.potential == "none"):
            raise ValueError(
                f"potential = {self.potential!r} does not go with the name {self.name!r}: "
                "the baseline alone is called none and has the potential none"
            )
        if self.potential == "none" and self.schedule != "constant":
            raise ValueError(
                f"schedule = {self.schedule!r} has no meaning with potential = 'none'; allowed: 'constant'"
            )
        return self


class Cell(Settings):
    """Protocol x variant x budget x alpha0, plus the root of its random streams: all that determines its training.

    `budget` is in environment steps; `alpha0` is the shaping weight at t = 0.
    """

    protocol: Protocol
    variant: Variant
    budget: Count
    alpha0: Alpha0 = 1.0
    root_seed: Seed = 0

    @model_validator(mode="after")
    def _budget_and_alpha0_are_possible(self) -> Self:
        if self.budget < self.protocol.ppo.rollout_steps:
            raise ValueError(
                f"budget = {self.budget} is below one rollout; allowed: >= {self.protocol.ppo.rollout_steps}"
            )
        if self.variant.potential == "none" and self.alpha0 != 1 and self.protocol.shaping.start_weight == "alpha0":
            raise ValueError(f"alpha0 = {self.alpha0} has no meaning with variant '{self.variant.name}'; allowed: 1")
        if self.protocol.shaping.form == "hurl" and self.variant.schedule in SCHEDULES_OF["rate"]:
            raise ValueError(
                f"shaping.form = 'hurl' has one discount for all runs, and schedule = {self.variant.schedule!r} a "
                "weight for each; allowed: a schedule that depends on the steps alone"
            )
        return self

    @property
    def folder(self) -> str:
        """Relative folder of the cell's files, e.g. `paper/l2/500000/alpha0.5`."""
        return f"{self.protocol.name}/{self.variant.name}/{self.budget}/alpha{plain(self.alpha0)}"

    @property
    def name(self) -> str:
        """The folder as one word, e.g. `paper-l2-500000-alpha0.5`: the cell's name in lists and file names."""
        return self.folder.replace("/", "-")

    @property
    def iterations(self) -> int:
        """Rollouts of the run: the budget rounded up to whole rollouts, ceil(budget / rollout_steps)."""
        return -(-self.budget // self.protocol.ppo.rollout_steps)

    @property
    def potential(self) -> str:
        """Name of the potential in use: the variant's own, but for a protocol that has one for every decay."""
        rule, decays = self.protocol.shaping.decay_potential, self.variant.horizon is not None
        return rule if decays and rule != "variant" else self.variant.potential

    @property
    def chosen_code(self) -> tuple[str, ...]:
        """What the cell's training looks up by name, as `module:name` below the package."""
        return (
            f"tasks.{self.protocol.environment.task}:TASK",
            f"training.potentials:{self.potential}",
            f"training.schedules:{self.variant.schedule}",
        )

    @property
    def key(self) -> dict[str, str | int | float]:
        """The columns that name the cell in every study-wide table."""
        return {
            "protocol": self.protocol.name,
            "variant": self.variant.name,
            "budget": self.budget,
            "alpha0": self.alpha0,
        }

    def settings(self) -> dict[str, Any]:
        """Everything that determines the cell's training, as plain JSON-able values with sorted keys."""
        settings: dict[str, Any] = _sorted(self.model_dump(mode="json"))
        return settings


def _sorted(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _sorted(value[key]) for key in sorted(value)}
    return value
