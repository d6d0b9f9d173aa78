"""Figures and videos as the page holds them: with their content in it, so that it needs no other file."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd

from reacher_shaping.labels import cell_order, setting_label, variant_label
from reacher_shaping.report.text import say
from reacher_shaping.settings.base import plain

MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png", ".gif": "image/gif", ".mp4": "video/mp4"}
_AS_THEY_ARE = " !$()*+,-./:;=?@[]^_`{|}~"  # characters that neither a URI nor an attribute of HTML has another use for
MEDIA_BUDGET = 11_000_000  # bytes of videos put into the page; the rest are left out


@dataclass(frozen=True)
class Picture:
    """A figure or video: name, title, caption, what it says in words, its content as a URI, and how it was made."""

    name: str
    title: str
    caption: str
    alternative: str
    source: str
    made: str = ""
    kind: str = "image"


def data_uri(path: Path) -> str:
    """A file's content as a URI, so that the page needs no other file; SVG stays text, smaller than in Base64."""
    if path.suffix == ".svg":
        return f"data:{MEDIA_TYPES[path.suffix]},{quote(path.read_text(encoding='utf-8'), safe=_AS_THEY_ARE)}"
    return f"data:{MEDIA_TYPES[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"


def videos(media: Sequence[Path], cells: pd.DataFrame) -> list[Picture]:
    """One video per cell, MP4 where there is one, while the budget of bytes lasts."""
    chosen = {path.stem: path for path in sorted(media, key=lambda path: path.suffix != ".gif")}
    shown, left = [], MEDIA_BUDGET
    for row in sorted(cells.to_dict("records"), key=cell_order):
        path = chosen.pop(_stem(row), None)
        if path is None or path.stat().st_size > left:
            continue
        left -= path.stat().st_size
        title = f"{variant_label(str(row['variant']))}, {setting_label(int(row['budget']), row['alpha0'])}"
        caption = say("computation.video", rate=f"{100 * row['success_rate']:.1f}\N{NO-BREAK SPACE}%")
        kind = "video" if path.suffix == ".mp4" else "image"
        shown.append(Picture(path.stem, title, caption, title, data_uri(path), kind=kind))
    return shown


def _stem(row: Mapping[Any, Any]) -> str:
    return f"{row['protocol']}-{row['variant']}-{row['budget']}-alpha{plain(row['alpha0'])}"
