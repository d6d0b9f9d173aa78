"""The arm in the page: what `arm.js` is given, and what stands there without JavaScript."""

import base64
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from reacher_shaping.evaluation.shown_policies import acting_numbers
from reacher_shaping.report.text import entry, say
from reacher_shaping.report.text_tables import Grid
from reacher_shaping.storage.files import ArtifactError, read_json
from reacher_shaping.storage.policy_format import read_policy, weights_checksum

SCRIPT = Path(__file__).with_name("arm.js")
REACH = 210  # mm; the arm's length


@dataclass(frozen=True)
class Player:
    """One policy: its name, what people call it, and the fingertip's path in the first evaluation episode."""

    name: str
    label: str
    path: Markup


@dataclass(frozen=True)
class Arm:
    """The section: its policies, a row on each, how many episodes that tells of, and what `arm.mount` takes.

    `radius` is the distance to the target that counts as success, in mm.
    """

    players: list[Player]
    grid: Grid
    episodes: str
    radius: float
    given: Mapping[str, Any]


def arm(summary: Path | None, radius: float) -> Arm | None:
    """The section from `policies.json` and the policies beside it; None where there are none.

    `radius` is the study's, in m. Raises ArtifactError for a policy that is not the one that the summary tells of, and
    for a summary that counts success at another radius.
    """
    shown = read_json(summary) if summary else {}
    if not summary or not shown:
        return None
    if other := {one["radius"] for one in shown.values() if one.get("radius", radius) != radius}:
        raise ArtifactError(summary, f"counts success at {other.pop():g} m, the study at {radius:g} m")
    names = entry("arm.policies")
    millimetres = round(1000 * radius, 6)
    shown = {name: shown[name] for name in sorted(shown, key=list(names).index)}
    policies = {name: _acting(summary.with_name(f"{name}.pt"), one) for name, one in shown.items()}
    players = [Player(name, names[name][0], _path(one, millimetres, names[name][0])) for name, one in shown.items()]
    rows = [
        [names[name][0], _percent(one["touched"]), _percent(one["ended"]), names[name][1], _run(one)]
        for name, one in shown.items()
    ]
    grid = Grid(list(entry("arm.headings")), rows, frozenset({0, 3, 4}))
    episodes = max(one["episodes"] for one in shown.values())
    given = {"policies": policies, "radius": radius, "words": entry("arm.script")}
    return Arm(players, grid, f"{episodes:,}", millimetres, given)


def _run(told: Mapping[str, Any]) -> str:
    return say("arm.run", cell=told["cell"], seed=told["seed"]) if "cell" in told else ""


def _acting(path: Path, told: Mapping[str, Any]) -> dict[str, Any]:
    """What moves the arm: a network's numbers, or a controller's."""
    if "gains" in told:
        return {"gains": told["gains"]}
    weights = read_policy(path).weights
    if weights_checksum(weights) != told["weights"]:
        raise ArtifactError(path, "is not the policy that policies.json tells of")
    return {"weights": base64.b64encode(acting_numbers(weights)).decode()}


def _path(one: Mapping[str, Any], radius: float, label: str) -> Markup:
    """The fingertip's way in one episode, the target drawn to scale; y points up."""
    x, y = one["target"]
    points = [tuple(map(float, point.split(","))) for point in one["path"].split()]
    way = " ".join(f"{px:g},{-py:g}" for px, py in points)
    end_x, end_y = points[-1]
    parts = (
        f'<circle class="reach" r="{REACH}"/><circle class="goal" cx="{x:g}" cy="{-y:g}" r="{radius:g}"/>'
        f'<polyline class="trail" points="{way}"/><circle class="tip" cx="{end_x:g}" cy="{-end_y:g}" r="9"/>'
    )
    said = Markup.escape(say("arm.path_alternative", policy=label, distance=f"{math.dist(points[-1], (x, y)):.0f}"))
    return Markup(f'<svg class="arm" viewBox="-220 -220 440 440" role="img" aria-label="{said}">{parts}</svg>')


def _percent(share: float) -> str:
    return f"{100 * share:.0f}\N{NO-BREAK SPACE}%"
