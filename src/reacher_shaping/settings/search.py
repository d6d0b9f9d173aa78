"""The search for a protocol's settings: what is fixed, what is tried, and the cell of a trial."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from reacher_shaping.settings.base import WHOLE, ConfigError, Count, Name, Seed, Settings, first_problem, to_tuple
from reacher_shaping.settings.cell import Cell, Protocol, Variant

VARIANT = "variant"
"""What in a search space is no setting but the name of a variant."""


class Range(Settings):
    """Numbers from `low` to `high` to search, whole ones if both are; evenly, or evenly in their logarithm."""

    low: float | int
    high: float | int
    log: bool = False

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        if not self.low < self.high or (self.log and self.low <= 0):
            raise ValueError(f"low = {self.low}, high = {self.high}: no range; allowed: low < high, and 0 < low if log")
        return self


class Choices(Settings):
    """Numbers, or names of variants, to choose from."""

    choices: Annotated[tuple[float | int | Name, ...], Field(min_length=1), BeforeValidator(to_tuple)]


class Search(Settings):
    """The search for a protocol's settings: `trials` of `seeds` runs each, under a root seed of their own.

    `fixed` and `space` map settings such as `ppo.discount`, or `alpha0`, to what they are in every trial and to what is
    tried, and `space` perhaps `variant` to names; the others are those of `protocol`. `budget` is in environment steps.
    """

    protocol: Name
    """Name of the protocol that has all that is not searched."""
    variant: Name
    """Name of the variant that is trained, where the space has none."""
    budget: Count
    """Environment steps of a run."""
    seeds: Annotated[int, Field(ge=1, le=1000), WHOLE]
    """Runs of a trial."""
    root_seed: Seed
    """Root of the trials' random streams."""
    trials: Annotated[int, Field(ge=1, le=10**5), WHOLE]
    """Settings to try."""
    maximise: Literal["mean_return", "success_rate", "final_success_rate"] = "mean_return"
    """The measure, a mean over the runs of a trial, that is to be high."""
    start: dict[str, float | int | Name] = Field(default_factory=dict)
    """Settings of the first trial, one for each that is searched; without them it is drawn as others are."""
    fixed: dict[str, bool | int | float | str] = Field(default_factory=dict)
    """Settings that every trial has, such as `ppo.learning_rate_schedule`."""
    space: Annotated[dict[str, Range | Choices], Field(min_length=1)]
    """Settings that are searched, such as `ppo.discount` or `alpha0`, and where."""

    @model_validator(mode="after")
    def _start_is_in_the_space(self) -> Self:
        if self.start and self.start.keys() != self.space.keys():
            wanted, given = (", ".join(sorted(map(repr, names))) for names in (self.space, self.start))
            raise ValueError(f"start has {given}; allowed: none, or what the space has, {wanted}")
        for path, value in self.start.items():
            own = self.space[path]
            numeric = isinstance(own, Range) and not isinstance(value, str) and own.low <= value <= own.high
            inside = numeric or (isinstance(own, Choices) and value in own.choices)
            if not inside:
                raise ValueError(f"start.{path} = {value!r} is not in the space")
        return self

    def variants(self) -> tuple[str, ...]:
        """Names of the variants that trials train."""
        own = self.space.get(VARIANT)
        return tuple(map(str, own.choices)) if isinstance(own, Choices) else (self.variant,)

    def corners(self) -> list[dict[str, Any]]:
        """The settings at the lower and at the upper end of the whole space."""
        ends = {
            path: (own.choices[0], own.choices[-1]) if isinstance(own, Choices) else (own.low, own.high)
            for path, own in self.space.items()
        }
        return [{path: pair[end] for path, pair in ends.items()} for end in (0, 1)]

    def cell(self, protocol: Protocol, variants: Mapping[str, Variant], values: Mapping[str, Any]) -> Cell:
        """The cell that a trial trains: `protocol` and alpha0 = 1 but for what is fixed and for `values`.

        `variants` are the known ones by name. Raises ConfigError where they make no cell.
        """
        settings = {**self.fixed, **values}
        variant = variants[settings.pop(VARIANT, self.variant)]
        changed = protocol.model_dump()
        for path, value in settings.items():
            part, _, key = path.partition(".")
            if path != "alpha0" and (not isinstance(changed.get(part), Mapping) or key not in changed[part]):
                raise ConfigError(f"{path!r} is no setting; allowed: alpha0, variant, or such as 'ppo.discount'")
            if key:
                changed[part][key] = value
        try:
            return Cell(
                protocol=Protocol.model_validate(changed),
                variant=variant,
                budget=self.budget,
                alpha0=settings.get("alpha0", 1.0),
                root_seed=self.root_seed,
            )
        except ValidationError as error:
            raise ConfigError(f"a trial with {settings}: {first_problem(error)}") from None
