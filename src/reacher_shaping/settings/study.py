"""The one schema of a study: what `config.yaml` may say, and the cells it stands for.

Unknown keys and impossible values are refused with a one-line `ConfigError`. Like `cell`, the module imports neither
torch nor numpy.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from reacher_shaping.settings.base import (
    ConfigError,
    Count,
    Name,
    Positive,
    Seed,
    Settings,
    Whole,
    first_problem,
    flat,
    short,
)
from reacher_shaping.settings.cell import Alpha0, Cell, Protocol, Variant
from reacher_shaping.settings.yaml_file import merged, read_mapping

RESERVED_FOLDERS = frozenset({"benchmarks", "experiments", "logs", "media", "notebooks", "peers", "search", "tables"})


class Evaluation(Settings):
    """Evaluation of every trained policy: episodes a run and mode; `radius` of success in m."""

    episodes: Annotated[Whole, Field(ge=1, le=10**6)] = 1000
    radius: Positive = 0.02


PEER_PPO: dict[str, Any] = {
    "learning_rate_schedule": "constant",
    "ratio_pairs": "sample",
    "advantage_normalisation": "minibatch",
    "adam_epsilon": 1e-5,
    "hidden_units": 64,
    "networks": "separate",
    "initialisation": "orthogonal",
    "initial_log_std": 0.0,
}
"""What Stable-Baselines3's PPO has for the settings that are not handed over to it (`sb3_baselines.train`)."""


class Peers(Settings):
    """The optional comparison with Stable-Baselines3: environment steps of each algorithm, and runs of each."""

    seeds: Annotated[Whole, Field(ge=1, le=1000)] = 3
    budgets: Annotated[
        dict[Literal["ppo", "sac", "td3"], Annotated[Whole, Field(ge=100, le=10**9)]], Field(min_length=1)
    ]


class Row(Settings):
    """One row of the grid: every variant x budget x alpha0, with optional changes to the protocol's settings."""

    protocol: Name = "paper"
    variants: Annotated[tuple[Name, ...], Field(min_length=1)]
    budgets: Annotated[tuple[Count, ...], Field(min_length=1)]
    alpha0: Annotated[tuple[Alpha0, ...], Field(min_length=1)] = (1.0,)
    environment: dict[str, Any] = Field(default_factory=dict)
    ppo: dict[str, Any] = Field(default_factory=dict)
    shaping: dict[str, Any] = Field(default_factory=dict)
    log: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _lists_to_tuples(cls, data: Any) -> Any:
        return {key: _to_tuple(value) for key, value in data.items()} if isinstance(data, Mapping) else data


def _to_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


Rows = Annotated[tuple[Row, ...], BeforeValidator(_to_tuple), Field(min_length=1)]
Names = Annotated[tuple[Name, ...], BeforeValidator(_to_tuple), Field(min_length=1)]


class Switches(Settings):
    """What each difference between two protocols does: cells of both ends, of each switch alone, and of all but it.

    `settings` maps a switch to the settings it stands for, such as `ppo.learning_rate`; `budget` is in environment
    steps; without `alone` the cells of each switch alone are left out.
    """

    start: Name
    end: Name
    settings: Annotated[
        dict[Name, Annotated[tuple[str, ...], BeforeValidator(_to_tuple), Field(min_length=1)]], Field(min_length=1)
    ]
    variants: Names
    budget: Count
    alpha0: Alpha0 = 1.0
    alone: bool = True


class Experiment(Settings):
    """A further study beside the main one, a target of its name: runs per cell, cells, and perhaps peers."""

    seeds: Annotated[Whole, Field(ge=1, le=10**5)]
    grid: Annotated[tuple[Row, ...], BeforeValidator(_to_tuple)] = ()
    switches: Switches | None = None
    peers: Peers | None = None

    @model_validator(mode="after")
    def _there_are_cells(self) -> Self:
        if not self.grid and self.switches is None:
            raise ValueError("grid is missing; allowed: a grid, switches, or both")
        return self


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
    """Numbers to choose from."""

    choices: Annotated[tuple[float | int, ...], BeforeValidator(_to_tuple), Field(min_length=1)]


class Search(Settings):
    """The search for a protocol's settings: `trials` of `seeds` runs each, under a root seed of their own.

    `fixed` and `space` map settings such as `ppo.discount`, or `alpha0`, to what they are in every trial and to what is
    tried; the others are those of `protocol`. `budget` is in environment steps.
    """

    protocol: Name
    variant: Name
    budget: Count
    seeds: Annotated[Whole, Field(ge=1, le=1000)]
    root_seed: Seed
    trials: Annotated[Whole, Field(ge=1, le=10**5)]
    fixed: dict[str, bool | int | float | str] = Field(default_factory=dict)
    space: Annotated[dict[str, Range | Choices], Field(min_length=1)]

    def corners(self) -> list[dict[str, Any]]:
        """The settings at the lower and at the upper end of the whole space."""
        ends = {
            path: (own.choices[0], own.choices[-1]) if isinstance(own, Choices) else (own.low, own.high)
            for path, own in self.space.items()
        }
        return [{path: pair[end] for path, pair in ends.items()} for end in (0, 1)]

    def cell(self, protocol: Protocol, variant: Variant, values: Mapping[str, Any]) -> Cell:
        """The cell that a trial trains: `protocol` and alpha0 = 1 but for what is fixed and for `values`.

        Raises ConfigError where they make no cell.
        """
        settings = {**self.fixed, **values}
        changed = protocol.model_dump()
        for path, value in settings.items():
            part, _, key = path.partition(".")
            if path != "alpha0" and (not isinstance(changed.get(part), Mapping) or key not in changed[part]):
                raise ConfigError(f"search: {path!r} is no setting; allowed: alpha0, or such as 'ppo.discount'")
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
            raise ConfigError(f"search: a trial with {settings}: {first_problem(error)}") from None


def _named(entries: Any) -> Any:
    """Give each entry of a mapping its key as `name`."""
    if not isinstance(entries, Mapping):
        return entries
    return {
        key: {"name": key, **entry} if isinstance(entry, Mapping) and "name" not in entry else entry
        for key, entry in entries.items()
    }


class Study(Settings):
    """All cells of a configuration, and how they are trained, evaluated and shown."""

    root_seed: Seed
    seeds: Annotated[Whole, Field(ge=1, le=10**5)]
    seeds_per_block: Annotated[Whole, Field(ge=1, le=1000)]
    protocols: Annotated[dict[Name, Protocol], BeforeValidator(_named), Field(min_length=1)]
    variants: Annotated[dict[Name, Variant], BeforeValidator(_named), Field(min_length=1)]
    grid: Rows
    evaluation: Evaluation
    peers: Peers
    experiments: dict[Name, Experiment] = Field(default_factory=dict)
    search: Search | None = None

    @model_validator(mode="after")
    def _grid_is_possible(self) -> Self:
        for entries, kind in ((self.protocols, "protocols"), (self.variants, "variants")):
            for name, entry in entries.items():
                if entry.name != name:
                    raise ValueError(f"{kind}.{name}.name = {entry.name!r} must equal its key; leave it out")
        for name in self.protocols:
            if name in RESERVED_FOLDERS:
                raise ValueError(f"protocols: the name {name!r} is a folder of results; allowed: any other name")
        for name, experiment in self.experiments.items():
            self._peers_have_partners(name, experiment)
        self._search_is_possible()
        known: dict[str, Cell] = {}
        for where, cells in {"grid": self.cells, **self.experiment_cells}.items():
            names = [cell.name for cell in cells]
            for cell in cells:
                if names.count(cell.name) > 1:
                    raise ValueError(
                        f"{where}: cell {cell.name} is there {names.count(cell.name)} times; allowed: once"
                    )
                if known.setdefault(cell.folder, cell) != cell:
                    raise ValueError(
                        f"{where}: cell {cell.name} is also in another study, with other settings; "
                        "allowed: the same, or a protocol of another name"
                    )
        return self

    def _peers_have_partners(self, name: str, experiment: Experiment) -> None:
        """Peers are held against the unshaped cells of the experiment's first protocol, and have its settings."""
        if experiment.peers is None:
            return
        cells = self.experiment_cells[name]
        protocol = cells[0].protocol
        budgets = {cell.budget for cell in cells if cell.protocol == protocol and cell.variant.name == "none"}
        for algorithm, budget in experiment.peers.budgets.items():
            if budget not in budgets:
                raise ValueError(
                    f"experiments.{name}.peers.budgets.{algorithm} = {budget} has no cell beside it; allowed: a budget "
                    f"of `none` under {protocol.name}: {', '.join(map(str, sorted(budgets))) or 'there is none'}"
                )
        for key, value in PEER_PPO.items():
            ours = getattr(protocol.ppo, key)
            if "ppo" in experiment.peers.budgets and ours != value:
                raise ValueError(
                    f"experiments.{name}.peers: Stable-Baselines3's PPO has {key} = {value!r}, the protocol "
                    f"{protocol.name} {ours!r}; allowed: a protocol that has the same"
                )

    def _search_is_possible(self) -> None:
        if self.search is None:
            return
        for key, known in (("protocol", self.protocols), ("variant", self.variants)):
            if getattr(self.search, key) not in known:
                value = getattr(self.search, key)
                raise ValueError(f"search.{key} = {value!r} is unknown; allowed: {', '.join(known)}")
        for values in self.search.corners():
            try:
                self.search.cell(self.protocols[self.search.protocol], self.variants[self.search.variant], values)
            except ConfigError as error:
                raise ValueError(str(error)) from None

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """The cells of the main study, in the order of the grid."""
        return self._cells_of_rows("grid", self.grid)

    @cached_property
    def experiment_cells(self) -> dict[str, tuple[Cell, ...]]:
        """The cells of each further study, by its name; some may be another's or the main study's too."""
        return {name: self._experiment_cells(name, experiment) for name, experiment in self.experiments.items()}

    def _experiment_cells(self, name: str, experiment: Experiment) -> tuple[Cell, ...]:
        cells = self._cells_of_rows(f"experiments.{name}.grid", experiment.grid)
        switches = experiment.switches
        return cells if switches is None else cells + self._switched_cells(switches, f"experiments.{name}.switches")

    def _switched_cells(self, switches: Switches, where: str) -> tuple[Cell, ...]:
        for key, value in (("start", switches.start), ("end", switches.end)):
            if value not in self.protocols:
                raise ValueError(f"{where}.{key} = {value!r} is unknown; allowed: {', '.join(self.protocols)}")
        start, end = (self.protocols[name].model_dump() for name in (switches.start, switches.end))
        protocols = [start, end]
        for switch, paths in switches.settings.items():
            for base, other, word in ((start, end, "with"), (end, start, "without")):
                if word == "with" and not switches.alone:
                    continue
                name = f"{base['name']}_{word}_{switch}"
                protocols.append(_switched(base, other, paths, f"{where}.settings.{switch}") | {"name": name})
        try:
            return tuple(
                self._cell(
                    Protocol.model_validate(protocol),
                    variant,
                    switches.budget,
                    1.0 if variant == "none" else switches.alpha0,
                    where,
                )
                for protocol in protocols
                for variant in switches.variants
            )
        except ValidationError as error:
            raise ValueError(f"{where}.{first_problem(error)}") from None

    def _cell(self, protocol: Protocol, variant: str, budget: int, alpha0: float, where: str) -> Cell:
        if variant not in self.variants:
            raise ValueError(f"{where}.variants = {variant!r} is unknown; allowed: {', '.join(self.variants)}")
        return Cell(
            protocol=protocol, variant=self.variants[variant], budget=budget, alpha0=alpha0, root_seed=self.root_seed
        )

    def _cells_of_rows(self, where: str, rows: tuple[Row, ...]) -> tuple[Cell, ...]:
        return tuple(cell for number, row in enumerate(rows) for cell in self._cells_of(f"{where}.{number}", row))

    def _cells_of(self, where: str, row: Row) -> list[Cell]:
        if row.protocol not in self.protocols:
            raise ValueError(f"{where}.protocol = {row.protocol!r} is unknown; allowed: {', '.join(self.protocols)}")
        protocol = self.protocols[row.protocol].model_dump()
        for part in ("environment", "ppo", "shaping", "log"):
            protocol[part] |= getattr(row, part)
        try:
            changed = Protocol.model_validate(protocol)
            return [
                self._cell(changed, variant, budget, alpha0, where)
                for variant, budget, alpha0 in product(row.variants, row.budgets, row.alpha0)
            ]
        except ValidationError as error:
            raise ValueError(f"{where}.{first_problem(error)}".replace("..", ".")) from None

    def blocks(self, seeds: int | None = None) -> tuple[range, ...]:
        """Consecutive ranges of run seeds that train together; more seeds leave every full block as it is.

        `seeds` are the main study's unless told.
        """
        count, size = seeds or self.seeds, self.seeds_per_block
        return tuple(range(first, min(first + size, count)) for first in range(0, count, size))


def _switched(base: dict[str, Any], other: Mapping[str, Any], paths: tuple[str, ...], where: str) -> dict[str, Any]:
    """The settings `base` with those at the dotted `paths` taken from `other`. Raises ValueError."""
    changed = {part: dict(value) if isinstance(value, Mapping) else value for part, value in base.items()}
    for path in paths:
        part, _, key = path.partition(".")
        if not isinstance(other.get(part), Mapping) or key not in other[part]:
            raise ValueError(f"{where} = {path!r} is no setting of a protocol; allowed: such as 'ppo.learning_rate'")
        if other[part][key] == base[part][key]:
            raise ValueError(
                f"{where} = {path!r} is {short(base[part][key])} at both ends; allowed: a setting that differs"
            )
        changed[part][key] = other[part][key]
    return changed


def block_name(seeds: range) -> str:
    """Folder of one seed block, e.g. `seeds0-9`."""
    return f"seeds{seeds[0]}-{seeds[-1]}"


def settings_hash(study: Study) -> str:
    """Return the SHA-256 of all settings of a study, as hexadecimal text."""
    settings = json.dumps(study.model_dump(mode="json"), sort_keys=True)
    return hashlib.sha256(settings.encode()).hexdigest()


def load_study(source: Mapping[str, Any] | Path | str) -> Study:
    """Read and validate a study.

    source: the path of a YAML file, or the mapping that such a file holds.
    Raises ConfigError, a single line, for the first thing that is wrong.
    """
    content, name = (source, "config") if isinstance(source, Mapping) else (read_settings(source), source)
    try:
        return Study.model_validate(dict(content))
    except ValidationError as error:
        raise ConfigError(f"{name}: {flat(first_problem(error))}") from None


def read_settings(*paths: Path | str) -> dict[str, Any]:
    """What YAML files say, each laid over those before it. Raises ConfigError."""
    return merged({}, *(read_mapping(path, tuple(Study.model_fields)) for path in paths))
