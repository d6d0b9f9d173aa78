"""The one schema of a study: what `config.yaml` may say, and the cells it stands for.

Unknown keys and impossible values are refused with a one-line `ConfigError`. The module imports neither torch nor
numpy, so that Snakemake builds its graph of jobs fast.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from decimal import Decimal
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
    model_validator,
)

RESERVED_FOLDERS = frozenset({"benchmarks", "experiments", "logs", "media", "notebooks", "peers", "search", "tables"})

Name = Annotated[str, StringConstraints(pattern=r"^[a-z0-9_]+$", max_length=40)]
Count = Annotated[int, Field(ge=1, le=10**12)]
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]


class ConfigError(ValueError):
    """A setting is missing, unknown or impossible; the message is one line: key, value, what is allowed."""


class Settings(BaseModel):
    """Base of all settings: immutable, no unknown keys, no silent conversion of types, only finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            for key, value in data.items():
                if key not in cls.model_fields:
                    allowed = ", ".join(cls.model_fields)
                    raise ValueError(f"{key} = {_short(value)} is no known key; allowed: {allowed}")
        return data


class Environment(Settings):
    """What surrounds Reacher-v5: the weight of the control cost, and whether actions are clipped to [-1, 1]."""

    control_weight: NonNegative = 0.1
    clip_actions: bool = False


class PPO(Settings):
    """Proximal policy optimisation (Schulman et al. 2017); the defaults are the paper's, as in config.yaml."""

    learning_rate: Positive = 3e-4
    learning_rate_schedule: Literal["constant", "linear"] = "constant"
    discount: Annotated[float, Field(gt=0, le=1)] = 0.99
    gae_lambda: Fraction = 0.95
    clip_range: Positive = 0.2
    ratio_pairs: Literal["sample", "minibatch"] = "sample"
    advantage_normalisation: Literal["rollout", "minibatch"] = "rollout"
    minibatch_size: Count = 64
    rollout_steps: Annotated[int, Field(ge=2, le=10**6)] = 2048
    epochs: Annotated[int, Field(ge=1, le=1000)] = 10
    value_coefficient: NonNegative = 0.5
    entropy_coefficient: NonNegative = 0.01
    max_gradient_norm: Positive = 0.5
    adam_epsilon: Positive = 1e-8
    hidden_units: Annotated[int, Field(ge=1, le=4096)] = 64
    networks: Literal["shared", "separate"] = "shared"
    initialisation: Literal["default", "orthogonal"] = "default"
    initial_log_std: float = 0.0

    @property
    def towers(self) -> int:
        """Trunks of a network: one for policy and value together, or one each."""
        return 2 if self.networks == "separate" else 1

    @model_validator(mode="after")
    def _minibatches_fill_the_rollout(self) -> Self:
        if self.rollout_steps % self.minibatch_size:
            raise ValueError(f"minibatch_size = {self.minibatch_size} must divide rollout_steps = {self.rollout_steps}")
        return self


class Shaping(Settings):
    """How the shaping reward is formed, and what holds at the last step of an episode."""

    form: Literal["paper", "dynamic"] = "paper"
    episode_end: Literal["terminal", "bootstrap"] = "terminal"
    terminal_potential: Literal["keep", "zero"] = "keep"
    decay_potential: Literal["variant", "l2sq"] = "variant"
    alpha0: Literal["weight", "label"] = "weight"


class Log(Settings):
    """What the protocol's own training log shows, in the column `logged_return`; nothing learns from it."""

    episode_return: Literal["unshaped", "released"] = "unshaped"


class Protocol(Settings):
    """A named, complete set of environment and algorithm choices."""

    name: Name
    environment: Environment = Environment()
    ppo: PPO = PPO()
    shaping: Shaping = Shaping()
    log: Log = Log()


class Variant(Settings):
    """One shaping rule: a potential and the schedule of its weight; `horizon` is in environment steps."""

    name: Name
    potential: Literal["none", "l2", "l2sq"]
    schedule: Literal["constant", "linear"] = "constant"
    horizon: Count | None = None

    @model_validator(mode="after")
    def _schedule_is_complete(self) -> Self:
        if self.schedule == "linear" and self.horizon is None:
            raise ValueError("horizon is missing; schedule = 'linear' needs a number of environment steps >= 1")
        if self.schedule == "constant" and self.horizon is not None:
            raise ValueError(f"horizon = {self.horizon} has no meaning with schedule = 'constant'; leave it out")
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
    alpha0: Positive = 1.0
    root_seed: Seed = 0

    @model_validator(mode="after")
    def _budget_and_alpha0_are_possible(self) -> Self:
        if self.budget < self.protocol.ppo.rollout_steps:
            raise ValueError(
                f"budget = {self.budget} is below one rollout; allowed: >= {self.protocol.ppo.rollout_steps}"
            )
        if self.variant.potential == "none" and self.alpha0 != 1 and self.protocol.shaping.alpha0 == "weight":
            raise ValueError(f"alpha0 = {self.alpha0} has no meaning with variant '{self.variant.name}'; allowed: 1")
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


class Evaluation(Settings):
    """Evaluation of every trained policy: episodes a run and mode; `radius` of success in m."""

    episodes: Annotated[int, Field(ge=1, le=10**6)] = 1000
    radius: Positive = 0.02


class Peers(Settings):
    """The optional comparison with Stable-Baselines3: environment steps of each algorithm, and runs of each."""

    seeds: Annotated[int, Field(ge=1, le=1000)] = 3
    budgets: Annotated[dict[Literal["ppo", "sac", "td3"], Annotated[int, Field(ge=100, le=10**9)]], Field(min_length=1)]


class Row(Settings):
    """One row of the grid: every variant x budget x alpha0, with optional changes to the protocol's settings."""

    protocol: Name = "paper"
    variants: Annotated[tuple[Name, ...], Field(min_length=1)]
    budgets: Annotated[tuple[Count, ...], Field(min_length=1)]
    alpha0: Annotated[tuple[Positive, ...], Field(min_length=1)] = (1.0,)
    environment: dict[str, Any] = {}
    ppo: dict[str, Any] = {}
    shaping: dict[str, Any] = {}

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
    alpha0: Positive = 1.0
    alone: bool = True


class Experiment(Settings):
    """A further study beside the main one, a target of its name: runs per cell, cells, and perhaps peers."""

    seeds: Annotated[int, Field(ge=1, le=10**5)]
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
    seeds: Annotated[int, Field(ge=1, le=1000)]
    root_seed: Seed
    trials: Annotated[int, Field(ge=1, le=10**5)]
    fixed: dict[str, bool | int | float | str] = {}
    space: Annotated[dict[str, Range | Choices], Field(min_length=1)]


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
    seeds: Annotated[int, Field(ge=1, le=10**5)]
    seeds_per_block: Annotated[int, Field(ge=1, le=1000)]
    protocols: Annotated[dict[Name, Protocol], BeforeValidator(_named), Field(min_length=1)]
    variants: Annotated[dict[Name, Variant], BeforeValidator(_named), Field(min_length=1)]
    grid: Rows
    evaluation: Evaluation
    peers: Peers
    experiments: dict[Name, Experiment] = {}
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

    def _search_is_possible(self) -> None:
        search = self.search
        if search is None:
            return
        for key, value, known in (
            ("protocol", search.protocol, self.protocols),
            ("variant", search.variant, self.variants),
        ):
            if value not in known:
                raise ValueError(f"search.{key} = {value!r} is unknown; allowed: {', '.join(known)}")
        settings = self.protocols[search.protocol].model_dump()
        for path in search.space:
            part, _, key = path.partition(".")
            if path != "alpha0" and (not isinstance(settings.get(part), Mapping) or key not in settings[part]):
                raise ValueError(f"search: {path!r} is no setting; allowed: alpha0, or such as 'ppo.discount'")

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
        for part in ("environment", "ppo", "shaping"):
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
                f"{where} = {path!r} is {_short(base[part][key])} at both ends; allowed: a setting that differs"
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
    content, name = (source, "config") if isinstance(source, Mapping) else (require_mapping(source), source)
    try:
        return Study.model_validate(dict(content))
    except ValidationError as error:
        raise ConfigError(f"{name}: {_flat(first_problem(error))}") from None


class _UniqueKeys(yaml.SafeLoader):
    """YAML in which no key of a mapping is there twice; plain YAML would take the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            name = str(key.value)
            if name in seen:
                raise yaml.constructor.ConstructorError(None, None, f"the key {name!r} is there twice", key.start_mark)
            seen.add(name)
        return super().construct_mapping(node, deep)


def require_mapping(path: Path | str) -> Mapping[str, Any]:
    """Read a YAML file that must hold a mapping with at least one key. Raises ConfigError."""
    try:
        content = yaml.load(Path(path).read_text(encoding="utf-8"), _UniqueKeys)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ConfigError(f"{path}: cannot be read as YAML: {_flat(error)}") from None
    if not content:
        raise ConfigError(f"{path}: is empty; allowed: a mapping with the keys {', '.join(Study.model_fields)}")
    if not isinstance(content, Mapping):
        raise ConfigError(
            f"{path}: {_short(content)} is not a mapping; allowed: the keys {', '.join(Study.model_fields)}"
        )
    return content


def plain(number: float) -> str:
    """A number in the shortest plain notation, without exponent or trailing zeros: 1.0 -> `1`, 0.5 -> `0.5`."""
    return format(Decimal(repr(number)).normalize(), "f")


def first_problem(error: ValidationError) -> str:
    """The first problem as `key = value: what is allowed`."""
    problem = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in problem["loc"] if part != "[key]")
    if problem["type"] == "missing":
        return f"{key} is missing"
    if problem["type"] == "value_error":  # raised by a validator here, with key and value in its own words
        message = str(problem["ctx"]["error"])
        return f"{key}.{message}" if key else message
    return f"{key} = {_short(problem['input'])}: {_allowed(problem['msg'])}"


def _allowed(message: str) -> str:
    """Pydantic's message in the words of YAML."""
    message = re.sub(r"^(Input|Value|String|Dictionary|Tuple) (?=should)", "", message)
    message = message.replace("valid tuple", "list").replace("valid dictionary", "mapping")
    return message.split(" after validation")[0].split(" or instance of")[0]


def _short(value: Any) -> str:
    text = _flat(repr(value))
    return text if len(text) <= 80 else f"{text[:77]}..."


def _flat(text: object) -> str:
    return " ".join(str(text).split())


def _sorted(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _sorted(value[key]) for key in sorted(value)}
    return value
