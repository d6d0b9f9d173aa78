"""Tables of cells: the paper's three with the published values beside ours, and two of measures the paper lacks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from reacher_shaping.labels import (
    CELL,
    budget_label,
    cell_order,
    in_groups,
    number,
    of_protocol,
    setting_label,
    variant_label,
)
from reacher_shaping.report.text import entry, say
from reacher_shaping.storage.files import write_text

MEASURED = ("success_rate", "mean_return", "final_success_rate", "final_distance")
BUDGETS = {"500K": 500_000, "1M": 1_000_000}
BEHAVIOUR = (
    "final_success_rate",
    "share_within_radius",
    "first_hit_step",
    "final_distance",
    "reward_distance",
    "reward_control",
)
LEARNING = ("steps_to_threshold", "area_under_curve", "drop_from_peak", "roughness")
# Column -> its heading, in the order of a readable table.
HEADINGS: Mapping[str, str] = entry("headings")
# Decimals and factor where they differ from 3 and 1.
FORMATS = {
    "improvement": (0, 100.0),
    "final_distance": (1, 1000.0),
    "first_hit_step": (1, 1.0),
    "reward_distance": (2, 1.0),
    "reward_control": (2, 1.0),
    "steps_to_threshold": (0, 0.001),
    "area_under_curve": (2, 1.0),
    "drop_from_peak": (2, 1.0),
}


def published_cells(table2: pd.DataFrame, table3: pd.DataFrame, left_out: pd.DataFrame | None = None) -> pd.DataFrame:
    """The paper's Tables 2 and 3 under our cell keys, and the run they leave out where it is given.

    Result: `variant, budget, alpha0, run, success_rate, mean_return, group`. Table 3 calls its variants
    `decay200K` and so on too, but shapes with the squared distance.
    """
    frames = []
    for table, suffix, group in ((table2, "", "main"), (table3, "_l2sq", "appendix"), (left_out, "", "main")):
        if table is None:
            continue
        frame = table.rename(columns={"alpha": "alpha0"}).astype({"alpha0": float})
        frame["variant"] = frame["variant_base"].str.lower() + suffix
        frame["budget"] = frame["num_episodes"].map(BUDGETS)
        frames.append(frame[[*CELL, "run", "success_rate", "mean_return"]].assign(group=group))
    return pd.concat(frames, ignore_index=True)


def table_1(cells: pd.DataFrame, published: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """The six cells of Table 2 with the highest success rate; columns as `table_2`."""
    return table_2(cells, published, protocol).head(6)


def table_2(cells: pd.DataFrame, published: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """Every cell of the main grid, best success rate first.

    Columns: `rank, variant, budget, alpha0, seeds, diverged`, then each measure with `_low` and
    `_high`, then `published_success_rate, published_mean_return, published_rank`.
    """
    return _ranked(cells, published, protocol, "main")


def table_3(cells: pd.DataFrame, published: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """Every decay cell with the L2-squared potential, best success rate first; columns as `table_2`."""
    return _ranked(cells, published, protocol, "appendix")


def _ranked(cells: pd.DataFrame, published: pd.DataFrame, protocol: str | None, group: str) -> pd.DataFrame:
    """Cells of a group, joined with the published rows, ranked by success rate."""
    ours = in_groups(of_protocol(cells, protocol), [group])
    theirs = in_groups(published, [group])
    theirs = theirs.assign(rank=theirs["success_rate"].rank(ascending=False, method="min"))
    theirs = theirs.drop(columns=["run", "group"]).set_index(CELL).add_prefix("published_").reset_index()
    measures = [f"{name}{end}" for name in MEASURED for end in ("", "_low", "_high")]
    table = ours[[*CELL, "seeds", "diverged", *measures]].merge(theirs, on=CELL, how="left")
    table = table.sort_values(["success_rate", *CELL], ascending=[False, True, True, True], ignore_index=True)
    table.insert(0, "rank", table["success_rate"].rank(ascending=False, method="min").astype("Int64"))
    return table.astype({"published_rank": "Int64"})


def behaviour(cells: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """What the policies of every cell do, by variant: `variant, budget, alpha0, seeds, diverged`, then each measure of
    `BEHAVIOUR` that `cells` has, with `_low` and `_high`.
    """
    return _measured(of_protocol(cells, protocol), BEHAVIOUR)


def learning(cells: pd.DataFrame, runs: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """How every cell learns: as `behaviour`, with the measures of `LEARNING` and `reached`, the number of runs that
    reach the threshold; the others count at their whole budget in `steps_to_threshold`.
    """
    table = _measured(of_protocol(cells, protocol), LEARNING)
    if "steps_to_threshold" in table:
        reached = of_protocol(runs, protocol).groupby(CELL)["steps_to_threshold"].count().rename("reached")
        table = table.merge(reached.reset_index(), on=CELL, how="left")
    return table


def robust(scores: pd.DataFrame, protocol: str | None = None) -> pd.DataFrame:
    """Success in measures that single runs cannot move, by variant, from the table of scores.

    Columns: the cell, seeds, `success_rate, iqm, improvement` with `_low` and `_high`.
    """
    rows = of_protocol(scores, protocol)
    rows = rows[rows["metric"] == "success_rate"].rename(columns=lambda name: str(name).replace("mean", "success_rate"))
    keys = [cell_order(row) for row in rows.to_dict("records")]
    names = [f"{name}{end}" for name in ("success_rate", "iqm", "improvement") for end in ("", "_low", "_high")]
    return rows[[*CELL, "seeds", *names]].iloc[sorted(range(len(keys)), key=keys.__getitem__)].reset_index(drop=True)


def _measured(cells: pd.DataFrame, measures: tuple[str, ...]) -> pd.DataFrame:
    columns = [f"{name}{end}" for name in measures if name in cells for end in ("", "_low", "_high")]
    table = cells[[*CELL, "seeds", "diverged", *columns]]
    keys = [cell_order(row) for row in table.to_dict("records")]
    return table.iloc[sorted(range(len(keys)), key=keys.__getitem__)].reset_index(drop=True)


def readable(table: pd.DataFrame) -> pd.DataFrame:
    """The table as people read it: every entry a string, headings with units, intervals in brackets."""
    columns: list[tuple[str, pd.Series]] = []
    cells = set(CELL) <= set(table)
    for name, heading in HEADINGS.items():
        if cells if name == "setting" else name in table and not (cells and name in CELL):
            texts = [_entry(name, row) for row in table.to_dict("records")]
            columns.append((heading, pd.Series(texts, dtype=str)))
    frame = pd.concat([series for _, series in columns], axis="columns")
    frame.columns = pd.Index([heading for heading, _ in columns])
    return frame


def cell_label(row: Mapping[Any, Any]) -> str:
    """A cell as people read it; without shaping there is no weight, unless one stands as a label."""
    variant, budget, alpha0 = str(row["variant"]), int(row["budget"]), float(row["alpha0"])
    unweighted = variant == "none" and alpha0 == 1
    setting = budget_label(budget) if unweighted else setting_label(budget, alpha0)
    return f"{variant_label(variant)}, {setting}"


def _entry(name: str, row: dict[Any, Any]) -> str:
    if name == "setting":
        return cell_label(row)
    value = row[name]
    if pd.isna(value):
        return "\N{EN DASH}"
    if name == "policy":
        return str(value)
    if name == "budget":
        return budget_label(int(value))
    if name == "seeds":
        return seed_count(value, row.get("diverged", 0))
    if name == "reached":
        return f"{value:.0f} of {row['seeds']:.0f}"
    if name in ("rank", "published_rank"):
        return f"{value:.0f}"
    digits, factor = decimals(name)
    text = number(factor * value, digits)
    low, high = row.get(f"{name}_low"), row.get(f"{name}_high")
    if low is None or high is None or pd.isna(low):
        return text
    return f"{text} [{number(factor * low, digits)}, {number(factor * high, digits)}]"


def decimals(name: str) -> tuple[int, float]:
    """Decimals of a measure and the factor it is shown with: shares in per cent, distances in mm."""
    if "success_rate" in name or name in ("share_within_radius", "iqm"):
        return 1, 100.0
    return FORMATS.get(name, (2 if "return" in name else 3, 1.0))


def seed_count(seeds: float, diverged: float) -> str:
    """A count of seeds, and in brackets how many of them diverged where some did."""
    return f"{seeds:.0f} ({diverged:.0f} diverged)" if diverged else f"{seeds:.0f}"


def to_markdown(frame: pd.DataFrame, caption: str) -> str:
    """A table as `table_2` gives it, formatted for reading, its caption above."""
    shown = readable(frame)
    lines = ["| " + " | ".join(shown.columns) + " |"]
    text_columns = {HEADINGS["setting"], HEADINGS["policy"]}
    lines.append("|" + "|".join(" :-- " if name in text_columns else " --: " for name in shown.columns) + "|")
    lines += ["| " + " | ".join(row) + " |" for row in shown.itertuples(index=False)]
    if shown.empty:
        lines.append(f"| {say('tables.none')} |" + " |" * (len(shown.columns) - 1))
    return f"{caption}\n\n" + "\n".join(lines) + "\n"


def to_csv(frame: pd.DataFrame) -> str:
    """The numbers of the table, in full."""
    return frame.to_csv(index=False, lineterminator="\n")


def save(frame: pd.DataFrame, caption: str, stem: Path) -> list[Path]:
    """Write the numbers as `stem.csv` and the formatted table as `stem.md`; return the paths."""
    texts = {"csv": to_csv(frame), "md": to_markdown(frame, caption)}
    paths = [stem.with_name(f"{stem.name}.{kind}") for kind in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        write_text(path, text)
    return paths
