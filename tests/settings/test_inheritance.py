"""A protocol says what differs from another, a value where it is from; both are resolved first."""

import json

import pytest

from reacher_shaping.settings.base import ConfigError
from reacher_shaping.settings.cell import Protocol
from reacher_shaping.settings.inheritance import resolved
from reacher_shaping.settings.study import load_study, read_settings, settings_hash

PAPER = {
    "environment": {"control_weight": {"value": 0.2, "source": "paper 3.1"}},
    "ppo": {"epochs": {"value": 7, "source": "release"}, "discount": 0.9},
}
LATE = {"from": "paper", "ppo": {"epochs": {"value": 8, "source": "ours: to see"}, "learning_rate": 0.001}}


def study(**protocols):
    """A study of one cell with these protocols."""
    return {
        "root_seed": {"value": 1, "source": "ours"},
        "seeds": 1,
        "seeds_per_block": 1,
        "protocols": protocols,
        "variants": {"none": {"potential": "none", "source": "paper 3.3"}},
        "grid": [{"variants": ["none"], "budgets": [{"value": 4096, "source": "paper 3.5"}], "source": "Table 2"}],
        "evaluation": {},
        "peers": {"budgets": {"ppo": 4096}},
    }


def test_a_protocol_has_all_of_the_other_but_what_it_says():
    late = load_study(study(paper=PAPER, late=LATE)).protocols["late"]
    ppo = {"epochs": 8, "discount": 0.9, "learning_rate": 0.001}
    assert late == Protocol.model_validate({"name": "late", "environment": {"control_weight": 0.2}, "ppo": ppo})


def test_inheritance_goes_on_through_protocols_in_any_order():
    protocols = load_study(study(last={"from": "late", "ppo": {"discount": 0.5}}, late=LATE, paper=PAPER)).protocols
    settings = protocols["last"].ppo
    assert (settings.epochs, settings.discount, settings.learning_rate) == (8, 0.5, 0.001)
    assert protocols["last"].environment.control_weight == 0.2


def test_sources_are_kept_beside_what_they_are_of():
    sources = load_study(study(paper=PAPER, late=LATE)).sources
    assert sources == {
        "root_seed": "ours",
        "protocols.paper.environment.control_weight": "paper 3.1",
        "protocols.paper.ppo.epochs": "release",
        "protocols.late.environment.control_weight": "paper 3.1",
        "protocols.late.ppo.epochs": "ours: to see",
        "variants.none": "paper 3.3",
        "grid.0": "Table 2",
        "grid.0.budgets.0": "paper 3.5",
    }


def test_a_value_changed_without_a_source_does_not_keep_the_old_one():
    changed = {"from": "paper", "ppo": {"epochs": 9}}
    sources = load_study(study(paper=PAPER, late=changed)).sources
    assert "protocols.late.ppo.epochs" not in sources


def test_the_source_of_a_part_is_that_of_its_settings_that_have_none(tmp_path):
    part = {"source": "paper 3.2", "discount": 0.9, "epochs": {"value": 7, "source": "release"}}
    late = {"from": "paper", "ppo": {"discount": 0.8, "clip_range": {"value": 0.1, "source": "ours"}}}
    (tmp_path / "config.yaml").write_text(json.dumps(study(paper={"ppo": part}, late=late)))
    (tmp_path / "overlay.yaml").write_text("protocols: {paper: {ppo: {gae_lambda: 0.5}}}")

    def sources(*files):
        made = load_study(read_settings(*(tmp_path / file for file in files)))
        assert made.protocols["late"].ppo.model_dump() | {"gae_lambda": 0.95} == made.protocols[
            "paper"
        ].ppo.model_dump() | {"discount": 0.8, "clip_range": 0.1, "gae_lambda": 0.95}
        return {key.removeprefix("protocols."): text for key, text in made.sources.items() if "ppo" in key}

    expected = {"paper.ppo.discount": "paper 3.2", "paper.ppo.epochs": "release"}
    expected |= {"late.ppo.epochs": "release", "late.ppo.clip_range": "ours"}
    assert sources("config.yaml") == expected, "the heir's discount is not the paper's"
    assert sources("config.yaml", "overlay.yaml") == expected, "nor is what another file lays over it"


def test_sources_and_inheritance_change_no_cell():
    plain = {"environment": {"control_weight": 0.2}, "ppo": {"epochs": 7, "discount": 0.9}}
    without, with_sources = load_study(study(paper=plain)), load_study(study(paper=PAPER))
    assert without.cells == with_sources.cells
    assert settings_hash(without) == settings_hash(with_sources)


def test_a_resolved_study_resolves_to_itself():
    once = load_study(study(paper=PAPER, late=LATE))
    assert load_study(once.model_dump(mode="json")) == once
    assert resolved(once.model_dump(mode="json")) == once.model_dump(mode="json")


@pytest.mark.parametrize(
    ("protocols", "message"),
    [
        ({"late": {"from": "text"}}, "protocols.late.from = 'text' is unknown; allowed: paper, late"),
        ({"late": {"from": ["paper"]}}, "protocols.late.from = ['paper'] is unknown"),
        ({"late": {"from": "late"}}, "protocols.late.from = 'late' leads back to itself"),
        ({"a": {"from": "b"}, "b": {"from": "a"}}, "protocols.b.from = 'a' leads back to itself"),
        ({"late": {"from": "paper", "ppo": {"lr": 1}}}, "protocols.late.ppo.lr = 1 is no known key"),
        (
            {"late": {"ppo": {"epochs": {"value": 3, "source": 4}}}},
            "protocols.late.ppo.epochs.source = 4: should be a text",
        ),
        ({"late": {"ppo": {"epochs": {"value": 3}}}}, "protocols.late.ppo.epochs = {'value': 3}: should be"),
        ({"late": {"ppo": {"epochs": {"value": 0, "source": "ours"}}}}, "protocols.late.ppo.epochs = 0: should be"),
    ],
)
def test_impossible_inheritance_or_source_is_refused_in_one_line(protocols, message):
    with pytest.raises(ConfigError) as refused:
        load_study(study(paper=PAPER, **protocols))
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)
