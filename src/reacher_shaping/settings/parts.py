"""Parts of a study: how its policies are evaluated, its rows of cells, switches between protocols, further studies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from reacher_shaping.settings.base import WHOLE, Count, Name, Positive, Seed, Settings, to_tuple
from reacher_shaping.settings.cell import Alpha0
from reacher_shaping.settings.search import Search


class Evaluation(Settings):
    """Evaluation of every trained policy: episodes a run and mode; `radius` of success in m."""

    episodes: Annotated[int, Field(ge=1, le=10**6), WHOLE] = 1000
    """Episodes per run and mode, the same resets for every run."""
    radius: Positive = 0.02
    """Distance in m from fingertip to target that counts as success."""


class Peers(Settings):
    """The optional comparison with Stable-Baselines3: environment steps of each algorithm, and runs of each."""

    seeds: Annotated[int, Field(ge=1, le=1000), WHOLE] = 3
    """Runs of each algorithm."""
    budgets: Annotated[
        dict[Literal["ppo", "sac", "td3"], Annotated[int, Field(ge=100, le=10**9), WHOLE]], Field(min_length=1)
    ]
    """Environment steps of each algorithm."""


class Row(Settings):
    """One row of the grid: every variant x budget x alpha0, with optional changes to the protocol's settings."""

    protocol: Name | Annotated[tuple[Name, ...], Field(min_length=1)] = "paper"
    """Name of the protocol that the cells are trained under, or several: the cells once under each."""
    variants: Annotated[tuple[Name, ...], Field(min_length=1)]
    """Names of variants."""
    budgets: Annotated[tuple[Count, ...], Field(min_length=1)]
    """Environment steps of training."""
    group: Literal["main", "appendix", "extra"] = "extra"
    """Where the paper has such cells: Tables 1 and 2, Table 3, or nowhere."""
    alpha0: Annotated[tuple[Alpha0, ...], Field(min_length=1)] = (1.0,)
    """Shaping weights at t = 0, without unit."""
    environment: dict[str, Any] = Field(default_factory=dict)
    """Settings of the protocol's environment that these cells have otherwise."""
    ppo: dict[str, Any] = Field(default_factory=dict)
    """Settings of the protocol's PPO that these cells have otherwise."""
    shaping: dict[str, Any] = Field(default_factory=dict)
    """Settings of the protocol's shaping that these cells have otherwise."""
    log: dict[str, Any] = Field(default_factory=dict)
    """Settings of the protocol's log that these cells have otherwise."""

    @model_validator(mode="before")
    @classmethod
    def _lists_to_tuples(cls, data: Any) -> Any:
        return {key: to_tuple(value) for key, value in data.items()} if isinstance(data, Mapping) else data


Rows = Annotated[tuple[Row, ...], Field(min_length=1), BeforeValidator(to_tuple)]
Names = Annotated[tuple[Name, ...], Field(min_length=1), BeforeValidator(to_tuple)]


class Switches(Settings):
    """What each difference between two protocols does: cells of both ends, of each switch alone, and of all but it.

    `settings` maps a switch to the settings it stands for, such as `ppo.learning_rate`; `budget` is in environment
    steps; without `alone` the cells of each switch alone are left out.
    """

    start: Name
    """Name of the protocol in which all switches are off."""
    end: Name
    """Name of the protocol in which all switches are on."""
    settings: Annotated[
        dict[Name, Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(to_tuple)]], Field(min_length=1)
    ]
    """The settings each switch stands for, such as `ppo.learning_rate`."""
    variants: Names
    """Names of variants."""
    budget: Count
    """Environment steps of training."""
    alpha0: Alpha0 = 1.0
    """Shaping weight at t = 0 of the shaped variants."""
    alone: bool = True
    """Whether each switch is also turned alone."""


class Experiment(Settings):
    """A further study beside the main one, a target of its name: runs per cell, cells, perhaps peers and a search."""

    title: str = ""
    """Heading of the study in the report."""
    question: str = ""
    """What the study asks, as the report introduces it."""
    seeds: Annotated[int, Field(ge=1, le=10**5), WHOLE]
    """Runs of each cell."""
    root_seed: Seed | None = None
    """Root of the study's own random streams, so that its runs share none with others; without it the main study's."""
    grid: Annotated[tuple[Row, ...], BeforeValidator(to_tuple)] = ()
    """Rows of cells."""
    lengths: bool = False
    """Whether its policies are evaluated on longer episodes too, as the main study's are."""
    switches: Switches | None = None
    """Two protocols and the differences between them, each alone or taken back."""
    peers: Peers | None = None
    """Stable-Baselines3's algorithms to hold the unshaped cells against."""
    search: Search | None = None
    """The search for settings of its protocol, on seeds of its own; an optional target."""

    @model_validator(mode="after")
    def _there_are_cells(self) -> Self:
        if not self.grid and self.switches is None:
            raise ValueError("grid is missing; allowed: a grid, switches, or both")
        return self
