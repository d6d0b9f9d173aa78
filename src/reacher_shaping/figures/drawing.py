"""Figures by their names: a figure is a function of the tables that its parameters name."""

import inspect
from collections.abc import Mapping
from types import ModuleType
from typing import Any

from matplotlib.figure import Figure

from reacher_shaping.figures import paper, robustness, studies

MAIN = (paper, robustness)
STUDY = (studies,)


def draw(name: str, tables: Mapping[str, Any], modules: tuple[ModuleType, ...] = MAIN) -> Figure:
    """The figure of that name: the function of that name, called with the tables that its parameters name.

    A parameter that is not among the tables keeps its default. Raises KeyError where no module has the function or a
    table without a default is missing.
    """
    function = next((getattr(module, name) for module in modules if hasattr(module, name)), None)
    if function is None:
        raise KeyError(f"no figure is called {name}")
    parameters = inspect.signature(function).parameters.values()
    missing = [one.name for one in parameters if one.default is one.empty and one.name not in tables]
    if missing:
        raise KeyError(f"the figure {name} is drawn from {', '.join(missing)}, which is not there")
    figure: Figure = function(**{one.name: tables[one.name] for one in parameters if one.name in tables})
    return figure
