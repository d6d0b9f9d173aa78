"""How a figure comes about: the function that draws it, the tables that it reads, and the command."""

import inspect

from reacher_shaping.figures import drawing
from reacher_shaping.report.text import say
from reacher_shaping.storage.tables import EXPERIMENT_TABLES, STUDY_TABLES


def sources(name: str, study: str = "") -> str:
    """Code, data and command behind a figure of the main study, or of a further one. Raises KeyError for no figure."""
    view = name.removeprefix(f"{study}_") if study else name
    function = drawing.function_of(view, drawing.STUDY if study else drawing.MAIN)
    module = function.__module__.removeprefix("reacher_shaping.").replace(".", "/")
    catalogue, folder = (EXPERIMENT_TABLES, f"results/experiments/{study}") if study else (STUDY_TABLES, "results")
    read = [catalogue[one].file for one in inspect.signature(function).parameters if one in catalogue]
    return say(
        "page.code_figure",
        code=f"`src/reacher_shaping/{module}.py`, `{view}`",
        data=", ".join(f"`{folder}/{file}`" for file in read),
        command=f"`snakemake -f -- figures/{name}.svg`",
    )
