"""Figures by their names: a figure is a function of the tables that its parameters name."""

import inspect
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from matplotlib.figure import Figure

from reacher_shaping.figures import hypotheses, paper, robustness, studies
from reacher_shaping.settings.study import MAIN as MAIN_STUDY

MAIN = (paper, robustness)
STUDY = (studies, hypotheses)


def modules_of(study: str) -> tuple[ModuleType, ...]:
    """Where the figures of a study are looked up: the main one has its own, which the paper has or which test it."""
    return MAIN if study == MAIN_STUDY else STUDY


def function_of(name: str, modules: tuple[ModuleType, ...] = MAIN) -> Callable[..., Figure]:
    """The function that draws the figure of that name. Raises KeyError where no module has it."""
    for module in modules:
        if hasattr(module, name):
            function: Callable[..., Figure] = getattr(module, name)
            return function
    raise KeyError(f"no figure is called {name}")


def draw(name: str, tables: Mapping[str, Any], modules: tuple[ModuleType, ...] = MAIN) -> Figure:
    """The figure of that name: the function of that name, called with the tables that its parameters name.

    A parameter that is not among the tables keeps its default. Raises KeyError where no module has the function or a
    table without a default is missing.
    """
    function = function_of(name, modules)
    parameters = inspect.signature(function).parameters.values()
    missing = [one.name for one in parameters if one.default is one.empty and one.name not in tables]
    if missing:
        raise KeyError(f"the figure {name} is drawn from {', '.join(missing)}, which is not there")
    return function(**{one.name: tables[one.name] for one in parameters if one.name in tables})
