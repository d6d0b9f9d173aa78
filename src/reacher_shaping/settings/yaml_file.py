"""Files of settings: YAML 1.2's core schema, no key twice, and bounds on what a file may make of itself.

PyYAML reads YAML 1.1, where 010 is 8, 1:30 is 90 and `no` is false. Its parser is kept and its schema replaced.
"""

from __future__ import annotations

import argparse
import re
import stat
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import yaml

from reacher_shaping.settings.base import ConfigError, flat, short

MOST_BYTES, MOST_DIGITS, MOST_VALUES, DEEPEST = 10**6, 40, 10**5, 20


def read_mapping(path: Path | str, keys: Sequence[str] = ()) -> dict[str, Any]:
    """Read a YAML file that must hold a mapping with at least one key, such as `keys`.

    Raises ConfigError, one line with the file, the line and what is wrong there.
    """
    content, name = _read(path, _CoreSchema), spelt_out(str(path))
    allowed = f"a mapping with the keys {', '.join(keys)}" if keys else "a mapping"
    if not content:
        raise ConfigError(f"{name}: is empty; allowed: {allowed}")
    if not isinstance(content, dict):
        raise ConfigError(f"{name}: {short(content)} is not a mapping; allowed: {allowed}")
    return content


def spelt_out(text: str) -> str:
    """A text as a terminal may show it: what would steer a terminal, as a key may, is spelt out: ESC as x1b."""
    return "".join(mark if mark.isprintable() else mark.encode("unicode_escape").decode() for mark in text)


def merged(base: Mapping[str, Any], *overlays: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with the overlays laid over it, mapping by mapping; any other value replaces what was there."""
    result = dict(base)
    for overlay in overlays:
        for key, value in overlay.items():
            below = result.get(key)
            if isinstance(value, Mapping) and isinstance(below, Mapping):
                value = merged(below, value)
            result[key] = value
    return result


def check_overlays(command: Sequence[str]) -> None:
    """Refuse what a command's `--configfile` names if it cannot be read, by us or by Snakemake. Raises SystemExit.

    Snakemake reads these files as YAML 1.1 before it reads the Snakefile, and what it cannot read ends in a traceback.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--configfile", "--configfiles", nargs="+", default=[])
    try:
        for path in parser.parse_known_args(command)[0].configfile:
            read_mapping(path)
            _read(path, _SnakemakesSchema)
    except ConfigError as error:
        raise SystemExit(f"ConfigError: {error}") from None


def _read(path: Path | str, loader: type[yaml.FullLoader | yaml.SafeLoader]) -> Any:
    name = spelt_out(str(path))
    try:
        found = Path(path).stat()
        if not stat.S_ISREG(found.st_mode):  # to read a pipe may take for ever, and Snakemake reads it again
            raise ConfigError(f"{name}: is no file; allowed: a file of settings")
        if found.st_size > MOST_BYTES:
            raise ConfigError(f"{name}: is too large for settings; allowed: at most {MOST_BYTES} bytes")
        content = yaml.load(Path(path).read_text(encoding="utf-8"), loader)
        _bound(content)
    except RecursionError:
        raise ConfigError(f"{name}: is nested too deep; allowed: {DEEPEST} levels") from None
    except yaml.MarkedYAMLError as error:
        place = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise ConfigError(f"{name}{place}: cannot be read as YAML: {flat(error.problem)}") from None
    except (OSError, ValueError, yaml.YAMLError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ConfigError(f"{name}: cannot be read as YAML: {flat(reason)}") from None
    return content


def _bound(content: Any) -> None:
    """Count all values as if each alias were written out. Raises ValueError."""
    waiting, count = [(content, 0)], 0
    while waiting:
        value, depth = waiting.pop()
        count += 1
        if depth > DEEPEST:
            raise ValueError(f"nested too deep; allowed: {DEEPEST} levels")
        if count > MOST_VALUES:
            raise ValueError(f"its aliases stand for more values than settings have; allowed: {MOST_VALUES}")
        inner = value.values() if isinstance(value, Mapping) else value if isinstance(value, list) else ()
        waiting.extend((child, depth + 1) for child in inner)


class _CoreSchema(yaml.SafeLoader):
    """The core schema of YAML 1.2 (section 10.3.2 of its specification), and no key of a mapping twice."""

    yaml_constructors: ClassVar[dict[str | None, Callable[..., Any]]] = {
        f"tag:yaml.org,2002:{kind}": yaml.SafeLoader.yaml_constructors[f"tag:yaml.org,2002:{kind}"]
        for kind in ("str", "seq", "map")
    } | {None: yaml.SafeLoader.construct_undefined}

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            name = str(key.value)
            if name in seen:
                raise yaml.constructor.ConstructorError(None, None, f"the key {name!r} is there twice", key.start_mark)
            seen.add(name)
        return super().construct_mapping(node, deep)


_CoreSchema.yaml_implicit_resolvers = {}


def _add(kind: str, pattern: str, read: Callable[[str], Any]) -> None:
    """Let plain scalars that match `pattern`, and those with the tag `!!kind`, be what `read` makes of them."""
    tag, allowed = f"tag:yaml.org,2002:{kind}", re.compile(rf"(?:{pattern})\Z")

    def construct(loader: yaml.SafeLoader, node: yaml.Node) -> Any:
        if isinstance(node, yaml.ScalarNode) and allowed.match(node.value) and len(node.value) <= MOST_DIGITS:
            return read(node.value)
        what = f"{kind} of at most {MOST_DIGITS} characters" if kind in {"int", "float"} else kind
        raise yaml.constructor.ConstructorError(None, None, f"{short(node.value)} is no {what}", node.start_mark)

    _CoreSchema.add_implicit_resolver(tag, allowed, None)
    _CoreSchema.add_constructor(tag, construct)


_BASES = {"0o": 8, "0x": 16}
_add("null", r"null|Null|NULL|~|", lambda text: None)
_add("bool", r"true|True|TRUE|false|False|FALSE", lambda text: text.lower() == "true")
_add("int", r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", lambda text: int(text, _BASES.get(text[:2], 10)))
_add("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
     lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")))  # fmt: skip


class _SnakemakesSchema(yaml.FullLoader):
    """YAML as Snakemake's own loader reads it, with each of its crashes turned into an error of its line."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except yaml.YAMLError:
            raise
        except (ValueError, KeyError, IndexError, AttributeError, TypeError) as error:
            problem = f"Snakemake takes {short(node.value)} for {node.tag.rpartition(':')[2]}: {error}; quote a text"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from None
