"""From the rows and switches of a study to its cells, each with the group it belongs to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

from pydantic import ValidationError

from reacher_shaping.paper_variants import of_group
from reacher_shaping.settings.base import first_problem, short
from reacher_shaping.settings.cell import Cell, Protocol, Variant
from reacher_shaping.settings.parts import Experiment, Row, Switches


class Placed(NamedTuple):
    """A cell, and where the paper has such cells: `main`, `appendix`, or `extra`."""

    cell: Cell
    group: str


@dataclass(frozen=True)
class Known:
    """What the rows of all studies name: protocols, variants, and the root of the random streams."""

    protocols: Mapping[str, Protocol]
    variants: Mapping[str, Variant]
    root_seed: int


def placed(study: Experiment, known: Known, where: str) -> tuple[Placed, ...]:
    """The cells of a study. `where` is its place in the configuration. Raises ValueError, which names it."""
    found = list(_of_rows(study.grid, known, f"{where}grid"))
    if study.switches is not None:
        found += [Placed(cell, "extra") for cell in _of_switches(study.switches, known, f"{where}switches")]
    if study.root_seed is None:
        return tuple(found)
    return tuple(Placed(cell.model_copy(update={"root_seed": study.root_seed}), group) for cell, group in found)


def _of_rows(rows: tuple[Row, ...], known: Known, where: str) -> Iterator[Placed]:
    for number, row in enumerate(rows):
        for protocol in [row.protocol] if isinstance(row.protocol, str) else row.protocol:
            for cell in _of_row(row, protocol, known, f"{where}.{number}"):
                yield Placed(cell, row.group)


def _of_row(row: Row, name: str, known: Known, where: str) -> list[Cell]:
    if name not in known.protocols:
        raise ValueError(f"{where}.protocol = {name!r} is unknown; allowed: {', '.join(known.protocols)}")
    protocol = known.protocols[name].model_dump()
    for part in ("environment", "ppo", "shaping", "log"):
        protocol[part] |= getattr(row, part)
    try:
        changed = Protocol.model_validate(protocol)
        cells = [
            _cell(changed, variant, budget, alpha0, known, where)
            for variant, budget, alpha0 in product(row.variants, row.budgets, row.alpha0)
        ]
    except ValidationError as error:
        raise ValueError(f"{where}.{first_problem(error)}".replace("..", ".")) from None
    papers = of_group(row.group)
    for variant in row.variants if row.group != "extra" else ():
        if variant not in papers:
            raise ValueError(
                f"{where}.variants = {variant!r} is no variant of the paper's group {row.group}; "
                f"allowed: {', '.join(papers)}, or without group"
            )
    return cells


def _of_switches(switches: Switches, known: Known, where: str) -> tuple[Cell, ...]:
    for key, value in (("start", switches.start), ("end", switches.end)):
        if value not in known.protocols:
            raise ValueError(f"{where}.{key} = {value!r} is unknown; allowed: {', '.join(known.protocols)}")
    start, end = (known.protocols[name].model_dump() for name in (switches.start, switches.end))
    protocols = [start, end]
    for switch, paths in switches.settings.items():
        for base, other, word in ((start, end, "with"), (end, start, "without")):
            if word == "with" and not switches.alone:
                continue
            name = f"{base['name']}_{word}_{switch}"
            protocols.append(_switched(base, other, paths, f"{where}.settings.{switch}") | {"name": name})
    try:
        return tuple(
            _cell(
                Protocol.model_validate(protocol),
                variant,
                switches.budget,
                1.0 if variant == "none" else switches.alpha0,
                known,
                where,
            )
            for protocol in protocols
            for variant in switches.variants
        )
    except ValidationError as error:
        raise ValueError(f"{where}.{first_problem(error)}") from None


def _cell(protocol: Protocol, variant: str, budget: int, alpha0: float, known: Known, where: str) -> Cell:
    if variant not in known.variants:
        raise ValueError(f"{where}.variants = {variant!r} is unknown; allowed: {', '.join(known.variants)}")
    return Cell(
        protocol=protocol, variant=known.variants[variant], budget=budget, alpha0=alpha0, root_seed=known.root_seed
    )


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
