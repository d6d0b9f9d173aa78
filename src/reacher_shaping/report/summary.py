"""What the study says first: an answer to each question with its number, three numbers to judge by, and reasons.

Everything is made from the study's tables; no number stands in a sentence here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from reacher_shaping.analysis.comparisons import corrected, mean_difference
from reacher_shaping.labels import CELL, in_groups, number, of_protocol, stochastic
from reacher_shaping.report.loader import Study
from reacher_shaping.report.quantities import shown, with_interval
from reacher_shaping.report.small_pictures import Bar
from reacher_shaping.report.text import entry, say

LEVEL = 0.05
PERCENT = "\N{NO-BREAK SPACE}%"
VERDICTS = ("reproduced", "not reproduced", "inconclusive", "untestable")
Row = Mapping[Any, Any]


@dataclass(frozen=True)
class Answer:
    """A question, the short answer to it, the sentence with the number, where the evidence is, and what a page adds."""

    question: str
    short: str
    because: str
    link: str
    more: str = ""


@dataclass(frozen=True)
class Summary:
    """The first screen: what was done, answers, numbers to judge by, verdict counts, reasons, and a picture's rows."""

    lead: str
    answers: list[Answer]
    numbers: list[tuple[str, str]]
    counts: list[str]
    why: list[str]
    bars: list[Bar]


def summary(study: Study, protocol: str | None = None) -> Summary:
    """The first screen of a study; what its tables do not tell is left out, and so are cells that the paper lacks."""
    study = _of_paper(study)
    cells = of_protocol(study.tables["cells"], protocol)
    if cells.empty:
        return Summary(say("summary.nothing"), [], [], [], [], [])
    published = study.published.merge(cells[CELL], on=CELL)
    counts = sorted(cells["seeds"].unique())
    runs = say("first.once") if counts[-1] == 1 else say("first.times", count=_span(counts))
    lead = say("first.lead" if len(published) else "first.lead_unpublished", published=len(published), runs=runs)
    return Summary(
        lead,
        answers(study, protocol),
        numbers(study, protocol),
        verdict_counts(study),
        why(study, protocol),
        bars(study, protocol),
    )


def _of_paper(study: Study) -> Study:
    """The study with its cells that the paper has; a study without any is left as it is."""

    def kept(tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        chosen = {
            name: in_groups(tables[name], ["main", "appendix"]) for name in ("cells", "comparisons") if name in tables
        }
        return {**tables, **({} if chosen["cells"].empty else chosen)}

    experiments = {name: kept(tables) for name, tables in study.experiments.items()}
    return replace(study, tables=kept(study.tables), experiments=experiments)


def _span(counts: Sequence[int]) -> str:
    return f"{counts[0]}" if counts[0] == counts[-1] else say("seeds.span", first=counts[0], last=counts[-1])


def answers(study: Study, protocol: str | None = None) -> list[Answer]:
    """An answer to each question that the tables can tell."""
    makers = {"potential": _by_family, "sparse": _by_hypothesis, "solve": _solved}
    found = (makers.get(name, _by_claim)(name, study, protocol) for name in entry("questions"))
    return [answer for answer in found if answer]


def _by_claim(name: str, study: Study, protocol: str | None) -> Answer | None:
    """The answer that a claim's verdict gives."""
    words = entry(f"questions.{name}")
    parts = study.tables.get("claim_parts")
    if parts is None or "claims" not in study.tables:
        return None
    claims = study.tables["claims"]
    judged = claims[claims["id"] == words["claim"]]
    rows = parts[(parts["id"] == words["claim"]) & (parts["part"] == words["part"])]
    if judged.empty or rows.empty:
        return None
    unit = entry(f"estimates.{words['claim']}")[words["part"]][1]
    row = rows.iloc[0].to_dict()
    if not np.isfinite(row["measured"]):
        return Answer(words["ask"], say("short.untestable"), "", words["link"])
    apart, cells = apart_from(study.tables.get("comparisons"), "none", protocol)
    effect = with_interval(row, "points").removesuffix(entry("units")["points"])
    because = say(f"questions.{name}.reason", effect=effect, apart=apart, cells=cells)
    if "against" in words and row["published"] < 0:
        because += f" {say(f'questions.{name}.against', published=shown(row['published'], unit))}"
    return Answer(words["ask"], say(f"short.{judged['verdict'].iloc[0]}"), because, words["link"])


def _by_family(name: str, study: Study, protocol: str | None) -> Answer | None:
    """The answer that a family of comparisons gives, corrected within it."""
    words = entry(f"questions.{name}")
    rows = _family(study.tables.get("comparisons"), words["family"], protocol)
    if rows.empty:
        return None
    apart, cells = apart_from(study.tables.get("comparisons"), words["family"], protocol)
    effect = number(100 * mean_difference(rows), 1)
    because = say(f"questions.{name}.reason", effect=effect, apart=apart, cells=cells)
    return Answer(words["ask"], say("short.apart" if apart else "short.same"), because, words["link"])


def _by_hypothesis(name: str, study: Study, protocol: str | None) -> Answer | None:
    """The answer that the first hypothesis of a further study gives, in runs that learned."""
    words = entry(f"questions.{name}")
    table = study.experiments.get(words["link"], {}).get("hypotheses")
    if table is None:
        return None
    row, decided = table.iloc[0], int((table["verdict"] != "open").sum())
    counts = {side: f"{row['runs'] * row[f'solved_{side}']:.0f}" for side in ("a", "b")}
    because = say(f"questions.{name}.reason", **counts, runs=f"{row['runs']:.0f}")
    more = say(f"questions.{name}.more", decided=decided, hypotheses=len(table))
    return Answer(words["ask"], say(f"short.{row['verdict']}"), because, words["link"], more)


def _solved(name: str, study: Study, protocol: str | None) -> Answer | None:
    """Whether PPO with settings of its own solves the task, and which switch did most for it."""
    words = entry(f"questions.{name}")
    row = _best(study)
    if row is None:
        return None
    switch = _best_switch(study)
    texts = {"rate": _percent(row["success_rate"]), "final": _percent(row["final_success_rate"])}
    more = say(f"questions.{name}.more", switch=switch) if switch else ""
    short = say("short.solved" if row["success_rate"] > 0.9 else "short.unsolved")
    return Answer(words["ask"], short, say(f"questions.{name}.reason", **texts), words["link"], more)


def _best(study: Study) -> Row | None:
    """The cell with the highest success of the study with settings that a search found."""
    tables = study.experiments.get(entry("questions.solve.link"))
    rows = [] if tables is None else tables["cells"].dropna(subset="success_rate").to_dict("records")
    return max(rows, key=lambda row: float(row["success_rate"])) if rows else None


def _best_switch(study: Study) -> str:
    """The setting that, as the last one changed, does most for the success of the study that leads to the best."""
    effects = study.experiments.get(entry("questions.solve.switches"), {}).get("effects")
    if effects is None:
        return ""
    last = effects[(effects["metric"] == "success_rate") & (effects["effect"] == "last")].dropna(subset="difference")
    return str(last.sort_values("difference")["setting"].iloc[-1]) if len(last) else ""


def _family(comparisons: pd.DataFrame | None, family: str, protocol: str | None) -> pd.DataFrame:
    if comparisons is None:
        return pd.DataFrame()
    rows = of_protocol(comparisons, protocol)
    return rows[(rows["family"] == family) & (rows["metric"] == "success_rate")]


def apart_from(comparisons: pd.DataFrame | None, family: str, protocol: str | None = None) -> tuple[int, int]:
    """In how many comparisons of a family success differs beyond chance, corrected, and of how many."""
    rows = _family(comparisons, family, protocol)
    return (int((rows["p_holm"] < LEVEL).sum()), len(rows)) if len(rows) else (0, 0)


def _percent(value: float) -> str:
    return f"{100 * value:.0f}{PERCENT}"


def _controller(study: Study, name: str, protocol: str | None) -> float:
    table = study.tables.get("controllers")
    if table is None:
        return float("nan")
    rows = stochastic(table, protocol)
    rows = rows[rows["controller"] == name]
    return float(rows["success_rate"].iloc[0]) if len(rows) else float("nan")


def _plain(study: Study, protocol: str | None) -> Row | None:
    """The unshaped cell with the largest budget."""
    cells = of_protocol(study.tables["cells"], protocol)
    rows = cells[cells["variant"] == "none"].sort_values("budget").to_dict("records")
    return rows[-1] if rows else None


def numbers(study: Study, protocol: str | None = None) -> list[tuple[str, str]]:
    """Three numbers that calibrate success: flailing, ending at the target, solved."""
    plain = _plain(study, protocol)
    values = {
        "flailing": _controller(study, "untrained network", protocol),
        "ending": float(plain["final_success_rate"]) if plain else float("nan"),
        "solved": _controller(study, "inverse kinematics + PD", protocol),
    }
    return [(_percent(value), say(f"first.numbers.{name}")) for name, value in values.items() if np.isfinite(value)]


def verdict_counts(study: Study) -> list[str]:
    """How many claims come out how, under the text and under the released code."""
    found = []
    released = study.experiments.get("released", {})
    for name, tables in (("first.counts", study.tables), ("first.counts_released", released)):
        if "claims" in tables:
            counts = tables["claims"]["verdict"].value_counts()
            texts = [f"{counts[verdict]} {verdict}" for verdict in VERDICTS if verdict in counts]
            found.append(say(name, claims=len(tables["claims"]), counts=", ".join(texts)))
    return found


def why(study: Study, protocol: str | None = None) -> list[str]:
    """Why the paper saw a gain, a line each."""
    published = study.published
    if published.merge(of_protocol(study.tables["cells"], protocol)[CELL], on=CELL).empty:
        return []
    return [text for text in (_one_run(study), _measure(study, protocol), _code(study), _left_out(study)) if text]


def _published_extremes(published: pd.DataFrame) -> tuple[float, float]:
    """Success of the unshaped published run with the largest budget, and of the best shaped one."""
    plain = published[published["variant"] == "none"].sort_values("budget")
    return float(plain["success_rate"].iloc[-1]), float(published["success_rate"].max())


def _one_run(study: Study) -> str:
    spread = study.tables.get("spread")
    ratio = pd.DataFrame() if spread is None else spread[spread["quantity"] == "ratio"]
    if ratio.empty:
        return ""
    none, best = _published_extremes(study.published)
    low, high = (number(float(ratio[name].iloc[0]), 1) for name in ("q05", "q95"))
    return say("why.one_run", low=low, high=high, published=number(best / none, 1))


def _measure(study: Study, protocol: str | None) -> str:
    untrained = _controller(study, "untrained network", protocol)
    if not np.isfinite(untrained):
        return ""
    return say("why.measure", best=_percent(_published_extremes(study.published)[1]), untrained=_percent(untrained))


def _code(study: Study) -> str:
    released = study.experiments.get("released")
    if not released:
        return ""
    shaped = released["comparisons"][released["comparisons"]["family"] == "none"]
    rows = corrected(shaped, ("success_rate",)) if len(shaped) else shaped
    rows = rows[rows["metric"] == "success_rate"] if len(rows) else rows
    verdicts = say("why.code_no_verdicts")
    if "claims" in released:
        counts = released["claims"]["verdict"].value_counts()
        verdicts = say(
            "why.code_verdicts",
            reproduced=counts.get("reproduced", 0),
            not_reproduced=counts.get("not reproduced", 0),
        )
    apart = int((rows["p_holm"] < LEVEL).sum()) if len(rows) else 0
    return say("why.code", apart=apart, cells=len(rows), verdicts=verdicts)


def _left_out(study: Study) -> str:
    """The published run that the tables leave out, where its success is the highest of all."""
    every = study.every_published
    left_out = every[~every["run"].isin(study.published["run"])]
    if left_out.empty or left_out["success_rate"].max() < every["success_rate"].max():
        return ""
    row = left_out.sort_values("success_rate").iloc[-1]
    rate = f"{100 * row['success_rate']:.1f}{PERCENT}"
    return say("why.left_out", run=f"`{row['run']}`", rate=rate, count=len(every))


def bars(study: Study, protocol: str | None = None) -> list[Bar]:
    """The rows of the small picture: what flails, the paper's, ours, and what is possible."""
    nan = float("nan")
    cells = of_protocol(study.tables["cells"], protocol)
    found = [Bar(say("first.bars.untrained"), _controller(study, "untrained network", protocol), nan, nan, ours=False)]
    if len(study.published.merge(cells[CELL], on=CELL)):
        for name, value in zip(("published_none", "published_best"), _published_extremes(study.published), strict=True):
            found.append(Bar(say(f"first.bars.{name}"), value, nan, nan, ours=False))
    shaped = cells[cells["variant"] != "none"].sort_values("success_rate").to_dict("records")
    plain, best = _plain(study, protocol), _best(study)
    if plain:
        limits = (float(plain["success_rate_low"]), float(plain["success_rate_high"]))
        found.append(Bar(say("first.bars.none"), float(plain["success_rate"]), *limits, ours=True))
    if shaped:  # the interval of a cell does not know that it was chosen for being the highest
        name = say("first.bars.best", count=len(shaped))
        found.append(Bar(name, float(shaped[-1]["success_rate"]), nan, nan, ours=True))
    if best:
        found.append(Bar(say("first.bars.solved"), float(best["success_rate"]), nan, nan, ours=True))
    return [bar for bar in found if np.isfinite(bar.value)]


def to_markdown(content: Summary) -> str:
    """The summary for a notebook and for the README."""
    lines = [content.lead, *(f"- {item.question} **{item.short}** {item.because}" for item in content.answers)]
    return "\n\n".join([lines[0], "\n".join(lines[1:]), " ".join(content.counts)]).strip()
