"""The study's answers in plain words, made from the tables of cells and claims. No number stands in a sentence here."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping.labels import budget_label, in_groups, number, of_protocol, setting_label, variant_label
from reacher_shaping.report.text import entry, say

Row = dict[Any, Any]
VERDICTS = ("reproduced", "not reproduced", "inconclusive", "untestable")


@dataclass(frozen=True)
class Answer:
    """A question, the short answer to it, and the sentences that bear it out."""

    question: str
    short: str
    because: list[str]


@dataclass(frozen=True)
class Summary:
    """What the study says first: a few sentences, then the answers to the guiding questions."""

    headline: list[str]
    answers: list[Answer]


def summary(cells: pd.DataFrame, claims: pd.DataFrame | None, protocol: str | None = None) -> Summary:
    """The headline and the four answers; without claims only what the table of cells shows."""
    ours = of_protocol(cells, protocol)
    headline = [_best_and_baseline(ours)] if not ours.empty else [say("summary.nothing")]
    if claims is None or claims.empty:
        return Summary([*headline, say("summary.untested")], [])
    return Summary(
        [*headline, _verdict_counts(claims)],
        [_answer(question["ask"], claims[claims["id"].isin(question["claims"])]) for question in entry("questions")],
    )


def _best_and_baseline(cells: pd.DataFrame) -> str:
    """The best cell of the main grid beside the unshaped cells."""
    main = in_groups(cells, ("none", "constant", "decay"))
    rows = (cells if main.empty else main).sort_values("success_rate", ascending=False).to_dict("records")
    plain = sorted((row for row in rows if row["variant"] == "none"), key=lambda row: row["budget"])
    shaped = [row for row in rows if row["variant"] != "none"]
    if not shaped:
        return say("summary.only_plain", rate=_percent(rows[0], "success_rate"))
    best = shaped[0]
    text = say("summary.best", cell=_name(best), rate=_percent(best, "success_rate"))
    if not plain:
        return say("summary.no_plain", best=text)
    rates = [
        say("summary.plain_rate", rate=_percent(row, "success_rate"), budget=budget_label(row["budget"]))
        for row in plain
    ]
    text = say("summary.plain", best=text, rates=" and ".join(rates))
    same = [row for row in plain if row["budget"] == best["budget"]]
    if not same:
        return text
    apart = same[0]["success_rate_high"] < best["success_rate_low"]
    return f"{text} {say('summary.apart' if apart else 'summary.overlap', budget=budget_label(best['budget']))}"


def _name(row: Row) -> str:
    return f"{variant_label(str(row['variant']))} ({setting_label(int(row['budget']), row['alpha0'])})"


def _percent(row: Row, name: str) -> str:
    """A rate in per cent with its interval."""
    text = f"{100 * row[name]:.1f} %"
    low, high = row.get(f"{name}_low", np.nan), row.get(f"{name}_high", np.nan)
    return text if np.isnan(low) else f"{text} [{100 * low:.1f}, {100 * high:.1f}]"


def _verdict_counts(claims: pd.DataFrame) -> str:
    counts = claims["verdict"].value_counts()
    parts = [f"{counts[verdict]} {verdict}" for verdict in VERDICTS if verdict in counts]
    return say("summary.counts", claims=len(claims), counts=", ".join(parts))


def _answer(question: str, claims: pd.DataFrame) -> Answer:
    """Yes where all claims behind a question are reproduced, no where none is and none is open."""
    verdicts = set(claims["verdict"])
    if not verdicts:
        short = "untested"
    elif verdicts == {"reproduced"}:
        short = "as_said"
    elif verdicts == {"not reproduced"}:
        short = "not_as_said"
    elif "reproduced" in verdicts:
        short = "partly" if "not reproduced" in verdicts else "partly_open"
    else:
        short = "not_shown" if "not reproduced" in verdicts else "open"
    return Answer(question, say(f"answers.{short}"), [claim_sentence(row) for row in claims.to_dict("records")])


def claim_sentence(row: Row) -> str:
    """One claim with its verdict and, where there is one, the measured effect."""
    text: str = "summary.claim_measured" if pd.notna(row["measured"]) else "summary.claim"
    return say(text, id=row["id"], claim=str(row["claim"]).rstrip("."), verdict=row["verdict"], effect=effect(row))


def effect(row: Row) -> str:
    """The measured effect of a claim with its interval, three significant digits."""
    values = [float(row[name]) for name in ("measured", "ci_low", "ci_high")]
    if np.isnan(values[0]):
        return "\N{EN DASH}"
    texts = [short_number(value) for value in values]
    return texts[0] if np.isnan(values[1]) else say("summary.interval", value=texts[0], low=texts[1], high=texts[2])


def short_number(value: float) -> str:
    """A number with about three significant digits and no exponent."""
    if not np.isfinite(value):
        return "\N{EN DASH}"
    size = abs(value)
    return number(value, 0 if size >= 100 else 1 if size >= 10 else 2 if size >= 1 else 3)


def to_markdown(content: Summary) -> str:
    """The summary for a notebook."""
    lines = [" ".join(content.headline)]
    lines += [f"- **{item.question}** {item.short} {' '.join(item.because)}" for item in content.answers]
    return "\n\n".join([lines[0], "\n".join(lines[1:])]).strip()


def claims_markdown(claims: pd.DataFrame) -> str:
    """Every claim with published evidence, measured effect, test and verdict."""
    headings = entry("summary.claims_headings")
    lines = [f"| {' | '.join(headings)} |", f"|{':--|' * len(headings)}"]
    for row in claims.to_dict("records"):
        entries = (row["id"], row["claim"], row["published"], effect(row), row["test"], f"**{row['verdict']}**")
        lines.append("| " + " | ".join(str(entry).replace("|", "\\|") for entry in entries) + " |")
    return "\n".join(lines)
