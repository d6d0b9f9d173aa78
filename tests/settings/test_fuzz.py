"""Thousands of mutated inputs: each is a clear error in one line, or valid."""

import copy
import json
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from cells import fresh_policy, small
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from reacher_shaping.evaluation.policies import load_policies
from reacher_shaping.jobs import training_job
from reacher_shaping.jobs.checkpoint import save_checkpoint
from reacher_shaping.settings.base import ConfigError
from reacher_shaping.settings.study import Study, load_study, read_settings
from reacher_shaping.storage import block_schemas
from reacher_shaping.storage.files import ArtifactError, read_table, write_table
from reacher_shaping.storage.policy_format import write_policy
from reacher_shaping.training.train import train

pytestmark = pytest.mark.slow

DEFAULT = read_settings(Path(__file__).parents[2] / "config.yaml")
NASTY = st.sampled_from(
    [
        "",
        " ",
        "..",
        "../../etc",
        "/tmp/x",
        "a b",
        "a'b",
        'a"b',
        "$(touch x)",
        "a;b",
        "a\nb",
        "ä",
        "none",
        "l2",
        "\0",
        "-1",
    ]
)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.integers(0, 3) | st.floats() | NASTY | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NASTY | st.text(max_size=5), inner, max_size=3),
    max_leaves=4,
)
MANY = settings(max_examples=1000, suppress_health_check=list(HealthCheck), derandomize=True)


def places(value, path=()):
    """The paths of all values inside a configuration."""
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, child in children for place in places(child, (*path, key)))]


PLACES = [place for place in places(DEFAULT) if place]


@st.composite
def configurations(draw):
    """The default configuration with up to three values replaced, removed, added or renamed."""
    config = copy.deepcopy(DEFAULT)
    for path in draw(st.lists(st.sampled_from(PLACES), min_size=1, max_size=3)):
        place = config
        try:
            for key in path[:-1]:
                place = place[key]
            old = place[path[-1]]
        except (KeyError, IndexError, TypeError):
            continue  # an earlier change removed it
        change = draw(st.sampled_from(["replace", "remove", "add", "rename"]))
        if change == "replace":
            place[path[-1]] = draw(VALUES)
        elif change == "remove":
            del place[path[-1]]
        elif isinstance(place, list):
            place.append(draw(VALUES))
        else:
            place[draw(NASTY)] = draw(VALUES) if change == "add" else old
    return config


@MANY
@given(configurations())
def test_mutated_configuration_is_refused_in_one_line_or_is_a_study(config):
    try:
        study = load_study(config)
    except ConfigError as error:
        assert str(error)
        assert "\n" not in str(error)
        assert len(str(error)) < 1000
        return
    assert isinstance(study, Study)
    for cell in study.cells:
        assert cell.iterations >= 1
        parts = Path(cell.folder).parts
        assert len(parts) == 4
        assert all(set(part) <= set("abcdefghijklmnopqrstuvwxyz0123456789_.") for part in parts), "safe in any shell"
        assert not {"..", "."} & set(parts), "nothing leaves the results"


@MANY
@given(st.text(max_size=200) | st.binary(max_size=200))
def test_any_file_as_configuration_is_refused_in_one_line(content):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.yaml"
        path.write_bytes(content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content)
        with pytest.raises(ConfigError) as refused:
            load_study(path)
    assert "config.yaml" in str(refused.value)
    assert "\n" not in str(refused.value)


@st.composite
def mutations(draw):
    """A function that damages bytes: some flipped, a piece cut out, repeated, zeroed or replaced."""
    kind = draw(st.sampled_from(["flip", "cut", "repeat", "zero", "replace"]))
    start, length = draw(st.floats(0, 1)), draw(st.integers(1, 64))
    noise = draw(st.binary(min_size=1, max_size=16))

    def damage(content: bytes) -> bytes:
        first = int(start * (len(content) - 1))
        head, piece, tail = content[:first], content[first : first + length], content[first + length :]
        return {
            "flip": head + bytes(byte ^ (noise[0] or 1) for byte in piece) + tail,
            "cut": head + tail,
            "repeat": head + piece + piece + tail,
            "zero": head + bytes(len(piece)) + tail,
            "replace": head + noise + tail,
        }[kind]

    return damage


@pytest.fixture(scope="module")
def stored(tmp_path_factory) -> Path:
    """One valid file of each kind."""
    folder = tmp_path_factory.mktemp("stored") / "key"
    cell = small("l2", iterations=2)
    *_, state = train(cell, [0, 1], success_radius=0.02)
    save_checkpoint(folder / "checkpoint.pt", state)
    policy = fresh_policy([0, 1])
    write_policy(folder / "policy.pt", [0, 1], policy.weights(), {"cell": cell.settings()})
    write_table(folder / "progress.parquet", state.progress_frame(), block_schemas.PROGRESS)
    return folder


@MANY
@given(damage=mutations())
def test_damaged_policy_is_refused_or_read_as_finite_weights(stored, damage):
    """Without a manifest beside it; torch's zip has checksums that it does not check when it reads."""
    content = damage((stored / "policy.pt").read_bytes())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "policy.pt"
        path.write_bytes(content)
        try:
            trained = load_policies(path)
        except ArtifactError as error:
            assert str(path) in str(error)
            assert "\n" not in str(error)
            return
    assert all(torch.isfinite(tensor).all() for tensor in trained.policy.weights().values())


@MANY
@given(damage=mutations())
def test_damaged_checkpoint_is_never_gone_on_from(stored, damage):
    content = (stored / "checkpoint.pt").read_bytes()
    damaged = damage(content)
    path = stored / "damaged" / "checkpoint.pt"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(damaged)
    if damaged != content:
        with pytest.raises(ArtifactError, match=r"checkpoint\.pt: is damaged"):
            training_job.load_checkpoint(path)


@MANY
@given(damage=mutations())
def test_damaged_table_is_refused_or_read_as_it_was(stored, damage):
    content = (stored / "progress.parquet").read_bytes()
    whole = read_table(stored / "progress.parquet", block_schemas.PROGRESS)
    path = stored / "damaged.parquet"
    path.write_bytes(damage(content))
    try:
        found = read_table(path, block_schemas.PROGRESS)
    except ArtifactError as error:
        assert str(path) in str(error)
        assert "\n" not in str(error)
        return
    pd.testing.assert_frame_equal(found, whole, check_exact=True)


@MANY
@given(
    content=st.dictionaries(st.sampled_from(["format", "seeds", "weights", "settings"]) | NASTY, VALUES),
    whole=st.booleans(),
)
def test_made_up_policy_is_refused(content, whole):
    """Valid torch files whose dict holds anything; with `whole`, the rest of it is as it should be."""
    policy = fresh_policy([0])
    base = {"format": 1, "seeds": [0], "weights": policy.weights(), "settings": json.dumps({"cell": {}})}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "policy.pt"
        torch.save((base if whole else {}) | content, path)
        with pytest.raises(ArtifactError) as refused:
            load_policies(path)
    assert "\n" not in str(refused.value)


def test_mutations_do_change_files():
    content = np.random.default_rng(0).bytes(1000)
    changed = []

    @settings(max_examples=200, derandomize=True)
    @given(mutations())
    def count(damage):
        changed.append(damage(content) != content)

    count()
    assert np.mean(changed) > 0.9
