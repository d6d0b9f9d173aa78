"""The claims as the report shows them: a row with two verdicts, and what it opens to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from reacher_shaping.report import captions, small_pictures
from reacher_shaping.report.quantities import DASH, in_words, rule_text, shown, with_interval, with_unit
from reacher_shaping.report.text import entry, say
from reacher_shaping.report.text_tables import Grid

Row = dict[str, Any]
MARKS = {"reproduced": "✓", "not reproduced": "✗", "inconclusive": "?", "untestable": DASH}
NOT_RUN = ""


@dataclass(frozen=True)
class Verdict:
    """A verdict with its mark; without a word where the study it takes has not been run."""

    word: str
    mark: str


@dataclass(frozen=True)
class Claim:
    """One row: id, claim, the measured value, its picture, the verdicts, and the rest as headings with texts."""

    name: str
    text: str
    measured: str
    picture: Markup
    verdicts: tuple[Verdict, Verdict]
    details: list[tuple[str, list[str]]]
    parts: list[tuple[str, Grid]]
    seen: list[tuple[str, str]]


def claims(
    ledger: Sequence[Mapping[str, Any]],
    under_text: Mapping[str, pd.DataFrame],
    under_code: Mapping[str, pd.DataFrame] | None = None,
    sensitivity: pd.DataFrame | None = None,
) -> list[Claim]:
    """All claims of the ledger that were judged.

    `under_text` and `under_code` hold the tables `claims` and `claim_parts` of the study of the paper's text and of
    that of the released code; the latter may not have been run. Raises KeyError for an estimate that the words do not
    know.
    """
    if "claims" not in under_text:
        return []
    code = under_code if under_code and "claims" in under_code else None
    judged = {row["id"]: row for row in _rows(under_text["claims"])}
    by_code = {row["id"]: row for row in _rows(code["claims"])} if code else {}
    found = []
    for one in ledger:
        if one["id"] not in judged:
            continue
        own = judged[one["id"]]
        test = newest(one)
        estimates = [row for row in _parts(under_text, one) if row["part"] in test["rules"]]
        first = estimates[0] if estimates else own | {"part": next(iter(test["rules"]))}
        unit = entry(f"estimates.{one['id']}")[first["part"]][1]
        other = by_code.get(one["id"])
        verdicts = (_verdict(own), _verdict(other) if other else Verdict(NOT_RUN, ""))
        grids = [("text", _grid(one, estimates, test["rules"]))]
        if code:
            own_parts = [row for row in _parts(code, one) if row["part"] in test["rules"]]
            grids.append(("code", _grid(one, own_parts, test["rules"])))
        choices = [] if sensitivity is None else [row for row in _rows(sensitivity) if row["id"] == one["id"]]
        found.append(
            Claim(
                one["id"],
                in_words(one["claim"]),
                with_interval(first, unit),
                _picture(first, test["rules"][first["part"]], unit),
                verdicts,
                details(one, test, own, choices),
                [(_caption(one["id"], where), grid) for where, grid in grids],
                [(name, captions.title(name).split(".")[0]) for name in one.get("shown_in", [])],
            )
        )
    return found


def newest(claim: Mapping[str, Any]) -> Mapping[str, Any]:
    """The test of a claim that counts."""
    newest_test: Mapping[str, Any] = claim["tests"][-1] if "tests" in claim else claim
    return newest_test


def _caption(claim: str, where: str) -> str:
    return say("claim.parts_caption", id=claim, where=say(f"claim.where.{where}"))


def details(
    claim: Mapping[str, Any], test: Mapping[str, Any], row: Row, choices: Sequence[Row]
) -> list[tuple[str, list[str]]]:
    """Headings and texts of an opened row."""
    tested = [in_words(test["test"])]
    if "dated" in test:
        tested = [say("claim.fixed", test=tested[0], dated=test["dated"])]
    if "reason" in test:
        tested.append(say("claim.changed", reason=in_words(test["reason"])))
        tested.append(say("claim.earlier", dated=row["first_dated"], verdict=row["first_verdict"]))
    parts = [("said", [f"{in_words(claim['evidence'])}."] if claim.get("evidence") else []), ("tested", tested)]
    parts.append(("note", [in_words(claim["note"])] if "note" in claim else []))
    parts.append(("worth", worth(row)))
    parts.append(
        ("sensitivity", [say("claim.choice", choice=one["choice"], verdict=one["verdict"]) for one in choices])
    )
    return [(say(f"claim.{name}"), texts) for name, texts in parts if texts]


def worth(row: Row) -> list[str]:
    """What a verdict is worth, as far as the table of claims says."""
    texts: list[str] = []
    replication = row.get("replication", np.nan)
    if pd.notna(replication):
        gated = row["interval_verdict"] != row["verdict"]
        name = "claim.gated" if gated else "claim.again"
        texts.append(say(name, verdict=row["interval_verdict"], chance=f"{replication:.2f}"))
    if pd.notna(row.get("seeds_to_decide", np.nan)):
        texts.append(say("claim.seeds", seeds=f"{row['seeds_to_decide']:.0f}"))
    if pd.notna(row.get("family_verdict", np.nan)):
        texts.append(say("claim.family", verdict=row["family_verdict"]))
    if pd.notna(row.get("power", np.nan)):
        texts.append(say("claim.power", power=f"{row['power']:.2f}", refuted=f"{row['refuted_if_true']:.2f}"))
    if pd.notna(row.get("second_verdict", np.nan)) and row["second_verdict"]:
        texts.append(say("claim.second", verdict=row["second_verdict"]))
    if row.get("published_holds") == 0:
        texts.append(say("claim.published_against"))
    return texts


def _picture(row: Row, rule: Mapping[str, Any], unit: str) -> Markup:
    label = say("claim.interval_of", measured=with_interval(row, unit), rule=rule_text(rule, unit))
    numbers = small_pictures.Interval(*(float(row[name]) for name in ("measured", "ci_low", "ci_high", "published")))
    return small_pictures.interval(numbers, small_pictures.band(rule), label)


def _grid(claim: Mapping[str, Any], estimates: Sequence[Row], rules: Mapping[str, Any]) -> Grid:
    """A row per estimate: what it is, published, measured, where the claim holds, runs, verdict."""
    rows = []
    for row in estimates:
        label, unit = entry(f"estimates.{claim['id']}")[row["part"]]
        published = with_unit(shown(float(row["published"]), unit), unit)
        holds = rule_text(rules[row["part"]], unit)
        rows.append([label, published, with_interval(row, unit), holds, f"{row['seeds']:.0f}", row["verdict"]])
    return Grid(list(entry("claim.parts")), rows, frozenset({0, 3, 5}))


def _parts(tables: Mapping[str, pd.DataFrame], claim: Mapping[str, Any]) -> list[Row]:
    """Rows of the estimates of a claim's newest test."""
    rows = _rows(tables["claim_parts"]) if "claim_parts" in tables else []
    return [row for row in rows if row["id"] == claim["id"] and row.get("current", True)]


def _verdict(row: Row) -> Verdict:
    return Verdict(row["verdict"], MARKS.get(row["verdict"], ""))


def _rows(frame: pd.DataFrame) -> list[Row]:
    return [{str(name): value for name, value in row.items()} for row in frame.to_dict("records")]


def to_markdown(rows: Sequence[Claim]) -> str:
    """Every claim with measured value, test and verdict, for a notebook."""
    headings = entry("summary.claims_headings")
    lines = [f"| {' | '.join(headings)} |", f"|{':--|' * len(headings)}"]
    for row in rows:
        tested = dict(row.details)[say("claim.tested")][0]
        entries = (row.name, row.text, row.measured, tested, f"**{row.verdicts[0].word}**")
        lines.append("| " + " | ".join(text.replace("|", "\\|") for text in entries) + " |")
    return "\n".join(lines)
