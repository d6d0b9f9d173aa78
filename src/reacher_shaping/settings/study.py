"""The one schema of a study: what `config.yaml` may say, and the cells it stands for.

Unknown keys and impossible values are refused with a one-line `ConfigError`. Like `cell`, the module imports neither
torch nor numpy.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from reacher_shaping.paper_variants import VARIANTS
from reacher_shaping.settings.base import (
    WHOLE,
    ConfigError,
    Name,
    Seed,
    Settings,
    first_problem,
    flat,
)
from reacher_shaping.settings.cell import LEARNED, Cell, Protocol, Variant
from reacher_shaping.settings.grid import Known, Placed, placed
from reacher_shaping.settings.inheritance import resolved, sourced
from reacher_shaping.settings.parts import Evaluation, Experiment, Peers, Rows
from reacher_shaping.settings.search import Search
from reacher_shaping.settings.yaml_file import merged, read_mapping, spelt_out

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
MAIN = "main"
RESERVED_FOLDERS = frozenset({"benchmarks", "experiments", "logs", "media", "notebooks", "peers", "search", "tables"})


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
    """Root of every random stream."""
    seeds: Annotated[int, Field(ge=1, le=10**5), WHOLE]
    """Runs of each cell of the main study."""
    seeds_per_block: Annotated[int, Field(ge=1, le=1000), WHOLE]
    """Runs that are trained together in one job."""
    title: str = ""
    """Heading of the main study in the report."""
    question: str = ""
    """What the main study asks."""
    protocols: Annotated[dict[Name, Protocol], Field(min_length=1), BeforeValidator(_named)]
    """Named, complete sets of environment and algorithm choices."""
    variants: Annotated[dict[Name, Variant], Field(min_length=1), BeforeValidator(_named)]
    """Shaping rules."""
    grid: Rows
    """Rows of cells of the main study."""
    evaluation: Evaluation
    """How every trained policy is evaluated."""
    peers: Peers
    """Stable-Baselines3's algorithms without shaping, an optional target."""
    experiments: dict[Name, Experiment] = Field(default_factory=dict)
    """Further studies, each a target of its name."""
    sources: dict[str, str] = Field(default_factory=dict)
    """Where each value is from, by its place such as `protocols.paper.ppo.discount`."""

    @model_validator(mode="before")
    @classmethod
    def _resolve(cls, data: Any) -> Any:
        return resolved(data) if isinstance(data, Mapping) else data

    @model_validator(mode="after")
    def _grid_is_possible(self) -> Self:
        self._variants_are_those_of_their_names()
        for entries, kind in ((self.protocols, "protocols"), (self.variants, "variants")):
            for name, entry in entries.items():
                if entry.name != name:
                    raise ValueError(f"{kind}.{name}.name = {entry.name!r} must equal its key; leave it out")
        for name in self.protocols:
            if name in RESERVED_FOLDERS:
                raise ValueError(f"protocols: the name {name!r} is a folder of results; allowed: any other name")
        if MAIN in self.experiments:
            raise ValueError(f"experiments: {MAIN!r} is the study beside it; allowed: any other name")
        for name, experiment in self.experiments.items():
            self._peers_have_partners(name, experiment)
            if experiment.search:
                self._search_is_possible(name, experiment.search)
        known: dict[str, Cell] = {}
        for name, own in self.designs.items():
            where, names = "grid" if name == MAIN else name, [cell.name for cell, _ in own]
            for cell, _ in own:
                if names.count(cell.name) > 1:
                    raise ValueError(
                        f"{where}: cell {cell.name} is there {names.count(cell.name)} times; allowed: once"
                    )
                if cell.potential in LEARNED and cell.protocol.shaping.episode_end == "terminal":
                    raise ValueError(
                        f"{where}: cell {cell.name} learns a potential beyond an episode's end, where nothing counts; "
                        f"allowed: a protocol with shaping.episode_end = 'bootstrap', unlike {cell.protocol.name}"
                    )
                if known.setdefault(cell.folder, cell) != cell:
                    raise ValueError(
                        f"{where}: cell {cell.name} is also in another study, with other settings; "
                        "allowed: the same, or a protocol of another name"
                    )
        return self

    def _variants_are_those_of_their_names(self) -> None:
        """A name of the paper's tables stands for what the paper calls so: labels and published values go by it."""
        for name, own in self.variants.items():
            paper = VARIANTS.get(name)
            for key in ("potential", "schedule", "horizon") if paper else ():
                if getattr(own, key) != getattr(paper, key):
                    raise ValueError(
                        f"variants.{name}.{key} = {getattr(own, key)!r} is not that of the paper's {name}; "
                        f"allowed: {getattr(paper, key)!r}, or another name"
                    )

    def _peers_have_partners(self, name: str, experiment: Experiment) -> None:
        """Peers are held against the unshaped cells of the experiment's first protocol, and have its settings."""
        if experiment.peers is None:
            return
        cells = self.cells_of[name]
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

    def _search_is_possible(self, name: str, search: Search) -> None:
        """Its names are known, every end of its space makes a cell, and its seeds are none that the study reports."""
        where = f"experiments.{name}.search"
        named = [("variant", variant) for variant in (search.variant, *search.variants())]
        for key, value in [("protocol", search.protocol), *named]:
            known = list(self.protocols if key == "protocol" else self.variants)
            if value not in known:
                raise ValueError(f"{where}.{key} = {value!r} is unknown; allowed: {', '.join(known)}")
        if search.root_seed in {cell.root_seed for cell in self.cells_of[name]}:
            raise ValueError(
                f"{where}.root_seed = {search.root_seed} is that of the study's own runs; allowed: another, so that "
                "these are fresh"
            )
        for values in search.corners():
            try:
                search.cell(self.protocols[search.protocol], self.variants, values)
            except ConfigError as error:
                raise ValueError(f"{where}: {error}") from None

    @cached_property
    def studies(self) -> dict[str, Experiment]:
        """The main study, under the name `main`, and the further ones."""
        main = Experiment(title=self.title, question=self.question, seeds=self.seeds, grid=self.grid, lengths=True)
        return {MAIN: main, **self.experiments}

    @cached_property
    def designs(self) -> dict[str, tuple[Placed, ...]]:
        """The cells of each study, in the order of its grid, each with its group."""
        known = Known(self.protocols, self.variants, self.root_seed)
        return {name: placed(study, known, where=_place(name)) for name, study in self.studies.items()}

    @cached_property
    def cells(self) -> tuple[Cell, ...]:
        """The cells of the main study, in the order of the grid."""
        return self.cells_of[MAIN]

    @cached_property
    def cells_of(self) -> dict[str, tuple[Cell, ...]]:
        """The cells of each study, by its name; some may be another's too."""
        return {name: tuple(cell for cell, _ in own) for name, own in self.designs.items()}

    def design(self, name: str) -> list[dict[str, Any]]:
        """The columns that each cell of a study has in its tables: the cell's key, and what the cell is for."""
        return [
            {
                **cell.key,
                "study": name,
                "group": group,
                **cell.variant.model_dump(include={"potential", "schedule", "horizon"}),
            }
            for cell, group in self.designs[name]
        ]

    def radius_of(self, cell: Cell) -> float:
        """Return the distance to the goal in m that counts as success for a cell."""
        return cell.protocol.environment.radius(self.evaluation.radius)

    def blocks(self, seeds: int | None = None) -> tuple[range, ...]:
        """Consecutive ranges of run seeds that train together; more seeds leave every full block as it is.

        `seeds` are the main study's unless told.
        """
        count, size = seeds or self.seeds, self.seeds_per_block
        return tuple(range(first, min(first + size, count)) for first in range(0, count, size))


def _place(study: str) -> str:
    """Where a study stands in the configuration, as the begin of a dotted path."""
    return "" if study == MAIN else f"experiments.{study}."


def block_name(seeds: range) -> str:
    """Folder of one seed block, e.g. `seeds0-9`."""
    return f"seeds{seeds[0]}-{seeds[-1]}"


def settings_hash(study: Study) -> str:
    """Return the SHA-256 of all settings of a study, as hexadecimal text; its words and sources do not count."""
    words: Any = {"title": True, "question": True}
    left_out: Any = {**words, "sources": True, "experiments": {"__all__": words}}
    settings = json.dumps(study.model_dump(mode="json", exclude=left_out), sort_keys=True)
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
        raise ConfigError(spelt_out(f"{name}: {flat(first_problem(error))}")) from None


def read_settings(*paths: Path | str) -> dict[str, Any]:
    """What YAML files say, each laid over those before it. Raises ConfigError."""
    return merged({}, *(sourced(read_mapping(path, tuple(Study.model_fields))) for path in paths))
