"""How a figure comes about: the function that draws it, the tables that it reads, and the command."""

import inspect

from reacher_shaping.figures import drawing
from reacher_shaping.report.text import say
from reacher_shaping.settings import outputs
from reacher_shaping.storage.tables import TABLES


def sources(study: str, view: str) -> str:
    """Code, data and command behind a figure of a study. Raises KeyError for no figure."""
    function = drawing.function_of(view, drawing.modules_of(study))
    module = function.__module__.removeprefix("reacher_shaping.").replace(".", "/")
    read = [TABLES[one].file for one in inspect.signature(function).parameters if one in TABLES]
    return say(
        "page.code_figure",
        code=f"`src/reacher_shaping/{module}.py`, `{view}`",
        data=", ".join(f"`results/{outputs.folder(study)}{file}`" for file in read),
        command=f"`snakemake -f -- figures/{outputs.stem(study, view)}.svg`",
    )
