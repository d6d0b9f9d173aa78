"""Figures a reader can ask: Vega-Lite specifications for the report's page, and the code that draws them there.

Each stands beside a figure that shows the same without JavaScript.
"""

from collections.abc import Callable, Mapping
from functools import cache

import altair as alt
import pandas as pd
import vl_convert

from reacher_shaping.figures.style import variant_color
from reacher_shaping.labels import cell_order, of_protocol, setting_label, settings_of, variant_label, variant_order

Chart = alt.LayerChart | alt.FacetChart
EVERY = 3
"""Every third iteration of a curve is enough for a screen."""
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

    Only those are there whose table is. `protocol` is the one shown; None takes the first.
    """
    return {
        figure: draw(of_protocol(tables[table], protocol)).to_json(indent=None).replace("</", "<\\/")
        for figure, (table, draw) in CHARTS.items()
        if table in tables and len(tables[table])
    }


def learning_curves(curves: pd.DataFrame) -> Chart:
    """Learning curves: choose budget and weight, click variants on and off, read values under the pointer."""
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
            _colors(ours, legend=alt.Legend(symbolOpacity=1)),
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
    layers = alt.layer(band, line.add_params(picked, setting), points.add_params(near))
    return layers.properties(
        width="container", height=320, description="Learning curves; click a variant in the legend to show it alone."
    )


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
        .encode(alt.Y("cell:N", sort=list(dict.fromkeys(ours["cell"])), title=None), _colors(ours, legend=None))
    )
    scale, axis = alt.Scale(domain=[0, 1]), alt.Axis(format=".0%", title="Success rate")
    tips = [alt.Tooltip("cell:N"), *(alt.Tooltip(f"{name}:Q", format=".1%") for name in ("success", "low", "high"))]
    interval = base.mark_rule().encode(alt.X("low:Q", scale=scale, axis=axis), alt.X2("high:Q"))
    dots = base.mark_point(filled=True, size=60).encode(alt.X("success:Q"), tooltip=tips)
    return alt.layer(interval, dots.add_params(kind, radius)).properties(
        width="container", description="Success of every setting at the radius of the slider."
    )


CHARTS: dict[str, tuple[str, Callable[[pd.DataFrame], Chart]]] = {
    "figure_1": ("curves", learning_curves),
    "success_by_radius": ("radii", success_at_radius),
}
"""Table and chart, by the figure that it stands beside."""


def _named(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows in the order of cells, variants and settings as people read them; `key` is the variant's name."""
    order = [cell_order(row) for row in frame[["variant", "alpha0", "budget"]].to_dict("records")]
    ordered = frame.iloc[sorted(range(len(frame)), key=order.__getitem__)]
    settings = [setting_label(*pair) for pair in zip(ordered["budget"], ordered["alpha0"], strict=True)]
    return ordered.assign(setting=settings, key=ordered["variant"], variant=ordered["variant"].map(variant_label))


def _colors(frame: pd.DataFrame, legend: alt.Legend | None) -> alt.Color:
    """Return every variant's own colour."""
    keys = sorted(set(frame["key"]), key=variant_order)
    scale = alt.Scale(domain=[variant_label(key) for key in keys], range=[variant_color(key) for key in keys])
    return alt.Color("variant:N", scale=scale, title=None, legend=legend)


def _data(frame: pd.DataFrame) -> alt.InlineData:
    """Return the rows as CSV text, a third of the size of JSON's."""
    types = {str(name): "number" for name in frame.select_dtypes("number").columns}
    return alt.InlineData(frame.to_csv(index=False), format=alt.CsvDataFormat(type="csv", parse=types))
