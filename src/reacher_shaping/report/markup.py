"""The little markup of the words, as HTML and as Typst: *emphasis*, `code` and [links](#where)."""

import re

from markupsafe import Markup, escape

_MARKS = re.compile(r"`([^`]+)`|\[([^\]]+)\]\(([^)]+)\)|\*([^*]+)\*")
_TYPST = re.compile(r"([\\#$*_`<>@\[\]~])")


def to_html(text: str) -> Markup:
    """The text as HTML; everything but the marks is shown as it is."""

    def replaced(found: re.Match[str]) -> str:
        code, label, target, emphasis = found.groups()
        if code:
            return f"<code>{code}</code>"
        return f'<a href="{target}">{label}</a>' if label else f"<em>{emphasis}</em>"

    return Markup(_MARKS.sub(replaced, str(escape(text))))


def to_typst(text: str) -> str:
    """The text as Typst markup; a link within the page becomes its label."""

    def plain(part: str) -> str:
        return _TYPST.sub(r"\\\1", part)

    parts, end = [], 0
    for found in _MARKS.finditer(text):
        parts.append(plain(text[end : found.start()]))
        code, label, target, emphasis = found.groups()
        if code:
            parts.append(f"#raw({_quoted(code)})")
        elif label:
            outside = target.startswith("http")
            parts.append(f"#link({_quoted(target)})[{plain(label)}]" if outside else plain(label))
        else:
            parts.append(f"#emph[{plain(emphasis)}]")
        end = found.end()
    return "".join([*parts, plain(text[end:])])


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
