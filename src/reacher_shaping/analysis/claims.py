"""The claims ledger: from estimates and rules to verdicts, and what each verdict is worth.

The ledger (`report/claims.yaml`, which explains its fields) holds for each claim dated tests with a rule per estimate;
the newest counts and the older ones stay beside it. The rules are about intervals: a claim is reproduced when every
value the data leave open agrees with it, not reproduced when none does, and inconclusive in between. So noise around no
effect is called a reproduction in at most one case of forty per estimate, and a weak study ends inconclusive, not
negative. A verdict is given only where another study of as many seeds would come to it again with a probability of at
least 0.9 (`replication`); else the claim is inconclusive, with the number of seeds that would decide.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping import stats
from reacher_shaping.analysis import replication as r
from reacher_shaping.analysis.claim_estimates import Estimate
from reacher_shaping.analysis.claim_formulas import PEERS, Measured, Study, as_published, measure

REPRODUCED = "reproduced"
NOT_REPRODUCED = "not reproduced"
INCONCLUSIVE = "inconclusive"
UNTESTABLE = "untestable"

# Below five seeds a t interval hangs on the normality of the seeds; Welch's between algorithms is taken from three.
FEWEST_SEEDS = 5
FEWEST_PEERS = 3

Entry = Mapping[str, Any]


def judge(low: float, high: float, rule: r.Rule) -> str:
    """Verdict on one estimate from its interval; without an interval inconclusive.

    Where an interval is both above `above` and below `refuted_below` the effect has the right sign but is
    smaller than worth the name: not reproduced.
    """
    marks = r.band(rule)
    if high < marks.refuted_below or low > marks.refuted_above:
        return NOT_REPRODUCED
    return REPRODUCED if low > marks.holds_above and high < marks.holds_below else INCONCLUSIVE


def combine(verdicts: Sequence[str]) -> str:
    """Verdict on a claim whose parts must all hold."""
    for verdict in (UNTESTABLE, NOT_REPRODUCED, INCONCLUSIVE):
        if verdict in verdicts:
            return verdict
    return REPRODUCED


def describe(rule: r.Rule) -> str:
    """A rule in words, for tables."""
    if "within" in rule:
        return f"within {rule['within'][0]:g} and {rule['within'][1]:g}"
    side, other, opposite = (
        ("above", "refuted_below", "below") if "above" in rule else ("below", "refuted_above", "above")
    )
    words = f"{side} {rule[side]:g}"
    return words + (f", refuted if {opposite} {rule[other]:g}" if other in rule else "")


def family_level(ledger: Sequence[Entry], measured: Measured, level: float = stats.LEVEL) -> float:
    """Level at which each estimate of the newest tests is read so that all of them together have `level`."""
    count = sum(part in measured[entry["id"]] for entry in ledger for part in entry["tests"][-1]["rules"])
    return 1 - (1 - level) / max(count, 1)


@dataclass(frozen=True)
class Part:
    """One estimate under one rule: ours, ours at the family's level, the published one, ours were the paper true."""

    claim: str
    name: str
    dated: str
    current: bool
    rule: r.Rule
    ours: Estimate | None
    family: Estimate | None
    published: Estimate | None
    if_true: Estimate | None

    @property
    def enough(self) -> bool:
        """Whether there are the seeds that a verdict takes."""
        return self.ours is not None and self.ours.seeds >= (FEWEST_PEERS if self.claim == PEERS else FEWEST_SEEDS)

    def verdict(self, estimate: Estimate | None) -> str:
        """Verdict from one of the intervals."""
        if estimate is None:
            return UNTESTABLE
        return judge(estimate.low, estimate.high, self.rule) if self.enough else INCONCLUSIVE

    @property
    def again(self) -> r.Chances:
        """Chances in another study of as many seeds."""
        return r.chances(self.ours, self.rule) if self.ours and self.enough else r.UNKNOWN

    @property
    def true(self) -> r.Chances:
        """Chances in such a study were the published tables exactly true; NaN where they say nothing."""
        if not (self.if_true and self.published and self.enough):
            return r.UNKNOWN
        return r.chances(self.if_true, self.rule, r.KNOWN)


def judged(ledger: Sequence[Entry], study: Study, published: pd.DataFrame) -> list[Part]:
    """Every estimate of every test, a claim's newest test first. `published` comes from `published_cells`."""
    measured = measure(study)
    family = measure(study, family_level(ledger, measured))
    theirs = measure(Study(published.assign(seed=0), untrained=study.untrained))
    if_true = measure(as_published(study, published))
    found = []
    for entry in ledger:
        for test in reversed(entry["tests"]):
            for name, rule in test["rules"].items():
                values = [source[entry["id"]].get(name) for source in (measured, family, theirs, if_true)]
                newest = test is entry["tests"][-1]
                found.append(Part(entry["id"], name, str(test["dated"]), newest, rule, *values))
    return found


def parts_frame(parts: Sequence[Part]) -> pd.DataFrame:
    """`claim_parts.csv`: a row per claim, test and estimate.

    Columns: id, part, published, measured, ci_low, ci_high, seeds, rule, verdict (of this estimate alone), dated,
    current (whether the test is the newest), family_low, family_high, family_verdict (limits that hold for all current
    estimates at once), replication (chance of the same verdict in another study of as many seeds), power and
    refuted_if_true (chance to find the estimate reproduced, or refuted, were the published tables exactly true), and
    the rule's marks (`replication.Band`).
    """
    rows = []
    for part in parts:
        ours = part.ours or Estimate(np.nan, np.nan, np.nan, 0)
        family = part.family or ours
        row: dict[str, Any] = {
            "id": part.claim,
            "part": part.name,
            "published": part.published.value if part.published else np.nan,
        }
        row |= {"measured": ours.value, "ci_low": ours.low, "ci_high": ours.high, "seeds": ours.seeds}
        row |= {"rule": describe(part.rule), "verdict": part.verdict(part.ours)}
        row |= {"dated": part.dated, "current": part.current, "family_low": family.low, "family_high": family.high}
        row |= {"family_verdict": part.verdict(part.family), "replication": again(row["verdict"], part.again)}
        row |= {"power": part.true.holds, "refuted_if_true": part.true.refuted}
        rows.append(row | r.band(part.rule)._asdict())
    return pd.DataFrame(rows)


def again(verdict: str, chances: r.Chances) -> float:
    """Chance that the same verdict comes out in another study; NaN where it is not known or nothing was tested."""
    unclear = float(np.clip(1 - chances.holds - chances.refuted, 0.0, 1.0))
    return {REPRODUCED: chances.holds, NOT_REPRODUCED: chances.refuted, INCONCLUSIVE: unclear}.get(verdict, np.nan)


def interval_verdicts(parts: Sequence[Part]) -> dict[str, str]:
    """What the intervals say of each claim by its newest test."""
    current = [part for part in parts if part.current]
    return {claim: _interval_verdict([p for p in current if p.claim == claim]) for claim in {p.claim for p in current}}


def claims_frame(
    ledger: Sequence[Entry], parts: Sequence[Part], second: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """`claims.csv`: id, claim, published, measured, ci_low, ci_high, test, verdict, and what the verdict is worth.

    The numbers are those of the claim's first estimate; the verdicts are over all of them. Further columns:

    | column | |
    |---|---|
    | dated | day of the test |
    | replication | chance that another study of as many seeds comes to `interval_verdict` |
    | interval_verdict | what the intervals say; with a `replication` below 0.9 `verdict` is inconclusive instead |
    | seeds_to_decide | seeds that would decide it, were the estimates the truth; missing for a verdict that is given |
    | family_verdict | with limits that hold for all estimates of the ledger at once |
    | power, refuted_if_true | chance to come out reproduced, or refuted, were the published tables exactly true |
    | published_holds | whether the published numbers themselves meet the rules; missing where there are none |
    | first_dated, first_verdict | the test fixed before any run, and what the intervals say by it |
    | second_verdict | `interval_verdict` of the second whole study (`second`, by claim); missing where there is none |
    """
    rows = []
    for entry in ledger:
        own = [part for part in parts if part.claim == entry["id"]]
        current = [part for part in own if part.current]
        first = [part for part in own if part.dated == str(entry["tests"][0]["dated"])]
        row = _claim(entry, current) | {"first_dated": first[0].dated, "first_verdict": _interval_verdict(first)}
        rows.append(row | {"second_verdict": (second or {}).get(entry["id"])})
    return pd.DataFrame(rows)


def _claim(entry: Entry, current: Sequence[Part]) -> dict[str, Any]:
    """A claim's row but for its first test."""
    numbers = parts_frame(current[:1]).iloc[0]
    shown = {name: numbers[name] for name in ("published", "measured", "ci_low", "ci_high")}
    verdict = _interval_verdict(current)
    replication = again(verdict, r.together([part.again for part in current]))
    settled = verdict in (REPRODUCED, NOT_REPRODUCED)
    given = INCONCLUSIVE if settled and not replication >= r.ENOUGH else verdict
    texts = {"id": entry["id"], "claim": entry["claim"]}
    row = texts | shown | {"test": entry["tests"][-1]["test"], "verdict": given, "dated": current[0].dated}
    true = r.together([part.true for part in current])
    row |= {"replication": replication, "interval_verdict": verdict, "seeds_to_decide": np.nan}
    if given == INCONCLUSIVE and all(part.enough for part in current):
        row["seeds_to_decide"] = r.seeds_to_decide([p.ours for p in current if p.ours], [p.rule for p in current])
    row |= {"family_verdict": combine([part.verdict(part.family) for part in current])}
    row |= {"power": true.holds, "refuted_if_true": true.refuted, "published_holds": _published_holds(current)}
    return row


def _interval_verdict(parts: Sequence[Part]) -> str:
    return combine([part.verdict(part.ours) for part in parts])


def _published_holds(parts: Sequence[Part]) -> float:
    """1 or 0: whether the published numbers, taken as exact, meet every rule; NaN where one is missing."""
    values = [part.published.value if part.published else np.nan for part in parts]
    if np.isnan(values).any():
        return float("nan")
    return float(all(judge(value, value, p.rule) == REPRODUCED for value, p in zip(values, parts, strict=True)))


def family_frame(parts: Sequence[Part], level: float = stats.LEVEL) -> pd.DataFrame:
    """`family_error.csv`: how often the ledger errs somewhere, a row per way of reading it.

    Columns: reading (`each` estimate at its own level, or the `family` at once), level, estimates, worst (chance that
    some claim is wrongly refuted where every true value lies on its mark and the estimates are independent).
    """
    count = sum(part.current and part.ours is not None for part in parts)
    levels = {"each": level, "family": 1 - (1 - level) / max(count, 1)}
    rows = [(reading, own, count, 1 - ((1 + own) / 2) ** count) for reading, own in levels.items()]
    return pd.DataFrame(rows, columns=["reading", "level", "estimates", "worst"])
