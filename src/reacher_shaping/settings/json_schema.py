"""The JSON schema of config.yaml, generated from the types for editors.

    python -m reacher_shaping.settings.json_schema

It says what the file may hold before inheritance and sources are resolved.
"""

import json
import sys
from pathlib import Path
from typing import Any

from reacher_shaping.settings.study import Study

SCHEMA = "docs/config.schema.json"
SOURCE = {"$ref": "#/$defs/Source"}


def config_schema() -> dict[str, Any]:
    """The schema as JSON-able values."""
    schema = Study.model_json_schema()
    for part in [schema, *schema["$defs"].values()]:
        part["properties"] = {name: _with_source(value) for name, value in part["properties"].items()}
        part["properties"]["source"] = SOURCE
    for name in ("Protocol", "Variant"):  # their key is their name
        part = schema["$defs"][name]
        del part["properties"]["name"]
        part["required"] = [key for key in part.get("required", []) if key != "name"]
    parent = {"type": "string", "description": "The protocol that all settings which are not named are taken from."}
    schema["$defs"]["Protocol"]["properties"]["from"] = parent
    del schema["properties"]["sources"]
    about = "Where a value is from, or all values of a part: a section of the paper, the release, or ours and why."
    schema["$defs"]["Source"] = {"type": "string", "description": about}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _with_source(value: dict[str, Any]) -> dict[str, Any]:
    """A property that may be given as `{value: ..., source: ...}` too, unless it is a mapping itself."""
    if value.get("type") == "object" or "$ref" in value or any("$ref" in kind for kind in value.get("anyOf", [])):
        return value
    about = {key: value[key] for key in ("description", "default") if key in value}
    kind = {key: entry for key, entry in value.items() if key not in (*about, "title")}
    pair = {
        "type": "object",
        "properties": {"value": kind, "source": SOURCE},
        "required": ["value", "source"],
        "additionalProperties": False,
    }
    return about | {"anyOf": [kind, pair]}


def text() -> str:
    """The schema as the file holds it."""
    return json.dumps(config_schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1] if len(sys.argv) > 1 else SCHEMA).write_text(text(), encoding="utf-8")
