"""Figures a reader can ask: Vega-Lite specifications for the report's page, and the code that draws them there.

Each stands beside a figure that shows the same without JavaScript.
"""

import inspect
from collections.abc import Callable, Mapping
from functools import cache

import altair as alt
import pandas as pd
import vl_convert

from reacher_shaping.analysis.learning_curves import EVERY
from reacher_shaping.figures.style import variant_look
from reacher_shaping.labels import cell_order, of_protocol, setting_label, settings_of, variant_label, variant_order

Chart = alt.LayerChart | alt.FacetChart
MEAN, ALL = "mean alone", "every seed"
"""What the reader may choose instead of a seed."""
DRAW = """
// A chart is drawn when it is opened. `ast`: its expressions are interpreted, so that a page may forbid `eval`.
for (const spec of document.querySelectorAll("script[data-chart]")) {
  const box = document.createElement("details"), title = document.createElement("summary");
  const place = document.createElement("div");
  box.className = "chart";
  title.textContent = spec.dataset.chart;
  box.append(title, place);
  spec.after(box);
  box.addEventListener("toggle", () => {
    if (!box.open || place.hasChildNodes()) return;
    vegaEmbed(place, JSON.parse(spec.textContent), {actions: false, renderer: "svg", ast: true});
  });
}
"""


@cache
def code() -> str:
    """Return the module of JavaScript that draws every specification of the page: Vega-Lite, and `DRAW`."""
    return vl_convert.javascript_bundle(DRAW).replace("</script", "<\\/script")


def charts(tables: Mapping[str, pd.DataFrame], protocol: str | None = None) -> dict[str, str]:
    """Return the specifications by the figure that each stands beside, as JSON that may stand within HTML.

    Only those are there whose tables are. `protocol` is the one shown; None takes the first.
    """
    found = {}
    for figure, draw in CHARTS.items():
        asked = inspect.signature(draw).parameters
        given = {name: of_protocol(tables[name], protocol) for name in asked if name in tables and len(tables[name])}
        if all(name in given or asked[name].default is None for name in asked):
            found[figure] = draw(**given).to_json(indent=None).replace("</", "<\\/")
    return found


def learning_curves(curves: pd.DataFrame, seed_curves: pd.DataFrame | None = None) -> Chart:
    """Learning curves: choose budget and weight, click variants on and off, read values under the pointer.

    With `seed_curves` (`learning_curves.seed_curves`) single seeds can be shown beside the means.
    """
    ours = _named(curves).dropna(subset="episode_return")
    ours = ours[ours["iteration"] % EVERY == 1]
    settings = [setting_label(*setting) for setting in settings_of(ours)]
    selector = alt.binding_select(options=settings, name="Budget and weight ")
    setting = alt.param("setting", value=settings[0], bind=selector)
    picked = alt.selection_point(fields=["variant"], bind="legend", toggle="true")
    near = alt.selection_point(fields=["env_steps"], on="pointerover", clear="pointerout", empty=False)
    base = (
        alt.Chart(_data(ours[["variant", "setting", "env_steps", "episode_return", "low", "high"]].round(2)))
        .transform_filter("datum.setting == setting")
        .encode(
            alt.X("env_steps:Q", title="Environment steps", axis=alt.Axis(format="~s")),
            *_looks(ours, alt.Legend(symbolOpacity=1, symbolType="stroke", symbolStrokeWidth=2)),
        )
    )
    value = alt.Y("episode_return:Q", title="Episode return, unshaped", scale=alt.Scale(zero=False))
    on, pointed = alt.when(picked), alt.when(near)
    tips = [alt.Tooltip("variant:N"), alt.Tooltip("env_steps:Q", format=",", title="environment steps")]
    names = {"episode_return": "return", "low": "low", "high": "high"}
    tips += [alt.Tooltip(f"{name}:Q", format=".2f", title=title) for name, title in names.items()]
    band = base.mark_area().encode(
        alt.Y("low:Q"), alt.Y2("high:Q"), opacity=on.then(alt.value(0.15)).otherwise(alt.value(0))
    )
    line = base.mark_line().encode(value, opacity=on.then(alt.value(1)).otherwise(alt.value(0.06)))
    points = base.transform_filter(picked).mark_point(filled=True, size=70)
    points = points.encode(value, tooltip=tips, opacity=pointed.then(alt.value(1)).otherwise(alt.value(0)))
    layers = [band, line.add_params(picked, setting), points.add_params(near)]
    if seed_curves is not None:
        layers.insert(1, _single_seeds(seed_curves, ours, on))
    return alt.layer(*layers).properties(
        width="container", height=320, description="Learning curves; click a variant in the legend to show it alone."
    )


def _single_seeds(seed_curves: pd.DataFrame, means: pd.DataFrame, on: alt.When) -> alt.Chart:
    """A thin line per run, none of them until the reader chooses; a run's values are one text, a tenth of the size."""
    runs = []
    for (variant, setting, seed), own in _named(seed_curves).groupby(["variant", "setting", "seed"], sort=False):
        own = own.dropna(subset="episode_return")
        if len(own) < 2:
            continue
        first, second = own["env_steps"].iloc[:2]
        values = " ".join(f"{value:.1f}" for value in own["episode_return"])
        runs.append([variant, setting, str(seed), first, second - first, values])
    frame = pd.DataFrame(runs, columns=["variant", "setting", "seed", "first", "step", "curve"])
    order = sorted(set(frame["seed"]), key=int)
    seeds = alt.param("seeds", value=MEAN, bind=alt.binding_select(options=[MEAN, ALL, *order], name="Seeds "))
    shown = (
        alt.Chart(_data(frame))
        .transform_filter(f"datum.setting == setting && (seeds == '{ALL}' || datum.seed == seeds)")
        .transform_calculate(value="split(datum.curve, ' ')", place="sequence(length(split(datum.curve, ' ')))")
        .transform_flatten(["value", "place"])
        .transform_calculate(value="toNumber(datum.value)", env_steps="datum.first + datum.step * datum.place")
    )
    tips = [alt.Tooltip("variant:N"), alt.Tooltip("seed:N")]
    lines: alt.Chart = shown.mark_line(strokeWidth=1).encode(
        alt.X("env_steps:Q"),
        alt.Y("value:Q"),
        *_looks(means, None),
        detail="seed:N",
        tooltip=tips,
        opacity=on.then(alt.value(0.7)).otherwise(alt.value(0)),
    )
    return lines.add_params(seeds)


def success_at_radius(radii: pd.DataFrame) -> Chart:
    """Success of every cell at a radius that a slider sets, at any step or at the last, with 95 % intervals."""
    ours = _named(radii[radii["mode"] == "stochastic"])
    ours = ours.assign(cell=ours["variant"] + " · " + ours["setting"], millimetres=(1000 * ours["radius"]).round(1))
    kinds = {"at any step": "success_rate", "at the last step": "final_success_rate"}
    columns = ["variant", "cell", "millimetres"]
    shown = pd.concat(
        ours[columns].assign(kind=kind, success=ours[name], low=ours[f"{name}_low"], high=ours[f"{name}_high"])
        for kind, name in kinds.items()
    )
    steps = sorted(ours["millimetres"].unique())
    step = float(steps[1] - steps[0]) if len(steps) > 1 else 1.0
    slider = alt.binding_range(min=float(steps[0]), max=float(steps[-1]), step=step, name="Radius (mm) ")
    radius = alt.param("radius", value=float(steps[len(steps) // 3]), bind=slider)
    kind = alt.param("kind", value=next(iter(kinds)), bind=alt.binding_select(options=list(kinds), name="Success "))
    base = (
        alt.Chart(_data(shown.round(4)))
        .transform_filter("abs(datum.millimetres - radius) < 0.01 && datum.kind == kind")
        .encode(alt.Y("cell:N", sort=list(dict.fromkeys(ours["cell"])), title=None), _looks(ours, None)[0])
    )
    scale, axis = alt.Scale(domain=[0, 1]), alt.Axis(format=".0%", title="Success rate")
    tips = [alt.Tooltip("cell:N"), *(alt.Tooltip(f"{name}:Q", format=".1%") for name in ("success", "low", "high"))]
    interval = base.mark_rule().encode(alt.X("low:Q", scale=scale, axis=axis), alt.X2("high:Q"))
    dots = base.mark_point(filled=True, size=60).encode(alt.X("success:Q"), tooltip=tips)
    return alt.layer(interval, dots.add_params(kind, radius)).properties(
        width="container", description="Success of every setting at the radius of the slider."
    )


CHARTS: dict[str, Callable[..., Chart]] = {"figure_1": learning_curves, "success_by_radius": success_at_radius}
"""The chart that stands beside a figure; its parameters are tables, and those with a default may be missing."""


def _named(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows in the order of cells, variants and settings as people read them; `key` is the variant's name."""
    order = [cell_order(row) for row in frame[["variant", "alpha0", "budget"]].to_dict("records")]
    ordered = frame.iloc[sorted(range(len(frame)), key=order.__getitem__)]
    settings = [setting_label(*pair) for pair in zip(ordered["budget"], ordered["alpha0"], strict=True)]
    return ordered.assign(setting=settings, key=ordered["variant"], variant=ordered["variant"].map(variant_label))


def _looks(frame: pd.DataFrame, legend: alt.Legend | None) -> tuple[alt.Color, alt.StrokeDash]:
    """Return every variant's own colour and dashes, told in one legend."""
    keys = sorted(set(frame["key"]), key=variant_order)
    labels, looks = [variant_label(key) for key in keys], [variant_look(key) for key in keys]
    colors = alt.Scale(domain=labels, range=[one.color for one in looks])
    dashes = alt.Scale(domain=labels, range=[list(one.dashes) for one in looks])
    return (
        alt.Color("variant:N", scale=colors, title=None, legend=legend),
        alt.StrokeDash("variant:N", scale=dashes, title=None, legend=legend),
    )


def _data(frame: pd.DataFrame) -> alt.InlineData:
    """Return the rows as CSV text, a third of the size of JSON's."""
    types = {str(name): "number" for name in frame.select_dtypes("number").columns}
    return alt.InlineData(frame.to_csv(index=False), format=alt.CsvDataFormat(type="csv", parse=types))
