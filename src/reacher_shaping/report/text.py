"""The report's words: they stand in `text.yaml`, and Python fills their holes."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import yaml

WORDS = Path(__file__).with_name("text.yaml")


@cache
def words() -> Mapping[str, Any]:
    """Everything in the file of words."""
    content: Mapping[str, Any] = yaml.safe_load(WORDS.read_text(encoding="utf-8"))
    return content


def entry(name: str) -> Any:
    """What stands under a dotted name such as `captions.figure_1`. Raises KeyError where there is nothing."""
    found: Any = words()
    for part in name.split("."):
        if not isinstance(found, Mapping) or part not in found:
            raise KeyError(f"{WORDS.name} has no {name}")
        found = found[part]
    return found


def say(name: str, /, **holes: object) -> str:
    """The text under a dotted name with its holes filled. Raises KeyError where it or what fills a hole is missing."""
    text = entry(name)
    if not isinstance(text, str):
        raise KeyError(f"{WORDS.name}: {name} is no text")
    try:
        return text.format(**holes)
    except KeyError as hole:
        raise KeyError(f"{WORDS.name}: nothing fills {{{hole.args[0]}}} of {name}") from None
