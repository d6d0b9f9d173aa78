"""The schema that editors read is generated from the types, and allows what the project's files say."""

import copy
from pathlib import Path

import jsonschema
import pytest

from reacher_shaping.settings import json_schema
from reacher_shaping.settings.study import read_settings

ROOT = Path(__file__).parents[2]
CONFIG, QUICK = ROOT / "config.yaml", ROOT / "workflow/quick.yaml"
VALIDATOR = jsonschema.Draft202012Validator(json_schema.config_schema())


def test_the_kept_schema_is_that_of_the_types():
    kept = (ROOT / json_schema.SCHEMA).read_text(encoding="utf-8")
    assert kept == json_schema.text(), "make it anew: python -m reacher_shaping.settings.json_schema"


def test_the_first_line_of_the_configuration_names_the_schema():
    assert CONFIG.read_text().splitlines()[0] == f"# yaml-language-server: $schema={json_schema.SCHEMA}"


@pytest.mark.parametrize("paths", [[CONFIG], [CONFIG, QUICK]], ids=["config", "quick"])
def test_the_projects_configurations_are_allowed(paths):
    VALIDATOR.validate(read_settings(*paths))


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        (["protocols", "paper", "ppo"], "lr", 0.1),
        (["protocols", "paper", "ppo"], "epochs", {"value": "many", "source": "ours"}),
        (["protocols", "paper", "ppo"], "epochs", 0),
        (["protocols", "paper", "ppo", "epochs"], "from", "paper"),
        (["protocols", "paper"], "from", 3),
        (["variants", "l2"], "potential", "l3"),
        ([], "seeds", -1),
    ],
)
def test_what_is_refused_is_not_allowed(part, key, value):
    config = copy.deepcopy(read_settings(CONFIG))
    place = config
    for name in part:
        place = place[name]
    place[key] = value
    with pytest.raises(jsonschema.ValidationError):
        VALIDATOR.validate(config)


def properties(schema):
    """All properties of a schema's parts, by part and name."""
    parts = {"Study": schema, **schema["$defs"]}
    return {(part, name): value for part, own in parts.items() for name, value in own.get("properties", {}).items()}


def test_every_setting_is_described():
    search = {("Range", name) for name in ("low", "high", "log")} | {("Choices", "choices")}
    found = properties(json_schema.config_schema())
    missing = {key for key, value in found.items() if not value.get("description") and key[1] != "source"}
    assert missing <= search
