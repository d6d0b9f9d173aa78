"""A dry run shows all settings as they are once nothing is left to other places."""

from pathlib import Path

from reacher_shaping.settings.overview import overview
from reacher_shaping.settings.study import load_study

ROOT = Path(__file__).parents[2]


def test_every_setting_of_every_protocol_is_shown():
    study = load_study(ROOT / "config.yaml")
    heading, *lines = overview(study).splitlines()
    assert heading.split() == list(study.protocols)
    rows = {line.split()[0]: line.split()[1:] for line in lines}
    assert rows["ppo.learning_rate"][:5] == ["0.0003", "0.0003", "0.001", "0.0003", "0.00081"]
    assert rows["environment.clip_actions"][:5] == ["false", "false", "false", "true", "true"]
    settings = next(iter(study.protocols.values())).model_dump(exclude={"name"})
    assert {f"{part}.{key}" for part, own in settings.items() for key in own} <= rows.keys()
    assert "variants.decay300k: potential: l2, schedule: linear, horizon: 300000" in lines
    assert "experiments.attribution: seeds: 10, cells: 20" in lines
