"""What config.yaml leaves to other places of it, resolved before it is validated: `from` of protocols, and sources."""

from collections.abc import Mapping
from typing import Any

from reacher_shaping.settings.base import short
from reacher_shaping.settings.yaml_file import merged


def resolved(config: Mapping[Any, Any]) -> dict[Any, Any]:
    """Return a configuration with whole protocols and plain values, and the sources of its values in `sources`.

    A protocol with `from: OTHER` is OTHER with its own settings laid over it. `{value: V, source: S}` is V, and a
    mapping with `source` beside other keys is that mapping without it; `sources` maps the place of each, such as
    `protocols.paper.ppo.discount`, to its text. The `source` of a part of a protocol, such as `ppo`, is that of each of
    its settings that has none. Raises ValueError.
    """
    config = sourced(config)
    protocols = config.get("protocols")
    if isinstance(protocols, Mapping):
        config["protocols"] = {name: _inherited(protocols, name, ()) for name in protocols}
    sources: dict[str, str] = {}
    plain = {key: _plain(value, str(key), sources) for key, value in config.items()}
    known = plain.get("sources", {})
    return {**plain, "sources": {**known, **sources}} if isinstance(known, Mapping) else plain


def sourced(config: Mapping[Any, Any]) -> dict[Any, Any]:
    """Return a configuration with the source of a protocol's part beside each of its settings that has none.

    Done before anything is laid over it: what is changed then, by an heir or another file, has not that source.
    """
    protocols = config.get("protocols")
    if not isinstance(protocols, Mapping):
        return {**config}
    each = {
        name: {key: _each_sourced(part) for key, part in own.items()} if isinstance(own, Mapping) else own
        for name, own in protocols.items()
    }
    return {**config, "protocols": each}


def _each_sourced(part: Any) -> Any:
    if not isinstance(part, Mapping) or not isinstance(part.get("source"), str):
        return part
    return {
        key: value if isinstance(value, Mapping) else {"value": value, "source": part["source"]}
        for key, value in part.items()
        if key != "source"
    }


def _inherited(protocols: Mapping[Any, Any], name: Any, heirs: tuple[Any, ...]) -> Any:
    own = protocols[name]
    if not isinstance(own, Mapping) or "from" not in own:
        return own
    parent = own["from"]
    if not isinstance(parent, str) or parent not in protocols:
        raise ValueError(
            f"protocols.{name}.from = {short(parent)} is unknown; allowed: {', '.join(map(str, protocols))}"
        )
    if parent in (*heirs, name):
        raise ValueError(
            f"protocols.{name}.from = {short(parent)} leads back to itself; allowed: a protocol that does not"
        )
    base = _inherited(protocols, parent, (*heirs, name))
    return merged(base if isinstance(base, Mapping) else {}, {key: own[key] for key in own if key != "from"})


def _plain(value: Any, place: str, sources: dict[str, str]) -> Any:
    """The value without its sources, which are added to `sources`."""
    if isinstance(value, list):
        return [_plain(entry, f"{place}.{number}", sources) for number, entry in enumerate(value)]
    if not isinstance(value, Mapping) or place == "sources":
        return value
    if "source" in value:
        if not isinstance(value["source"], str):
            raise ValueError(f"{place}.source = {short(value['source'])}: should be a text")
        sources[place] = value["source"]
        value = {key: inner for key, inner in value.items() if key != "source"}
        if value.keys() == {"value"}:
            return value["value"]
    return {key: _plain(inner, f"{place}.{key}", sources) for key, inner in value.items()}
