"""`make check-bits`: a published block trained again, and its bits compared."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from cells import small

from reacher_shaping.storage.policy_format import weights_checksum
from reacher_shaping.storage.provenance import versions
from reacher_shaping.storage.reference import published_bits
from reacher_shaping.training.train import train

ROOT = Path(__file__).parents[2]


def block(variant="none", env_steps=100, **changes):
    """What a block's manifest says, as far as the published bits need it."""
    cell = small(variant, iterations=1)
    given = {"settings": {"cell": cell.settings(), "radius": 0.02}, "seeds": [0, 1], "weights": "0" * 64}
    record = {"kernels": "portable", "core_type": "Haswell", "machine": {}, "versions": versions()}
    return {**given, **record, "env_steps": env_steps, **changes}


def check(path):
    return subprocess.run(
        [sys.executable, str(ROOT / "workflow/check_bits.py"), str(path)],
        cwd=path.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_a_block_with_the_published_bits_is_equal_and_any_other_is_not(tmp_path):
    published, path = published_bits([block()]), tmp_path / "bits.json"
    *_, state = train(small("none", iterations=1), [0, 1], success_radius=0.02)
    weights = state.policy().weights()
    path.write_text(json.dumps(published | {"weights": weights_checksum(weights)}))
    done = check(path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1].startswith("equal: ")
    path.write_text(json.dumps(published | {"versions": versions() | {"mujoco": "1.0"}}))
    done = check(path)
    assert done.returncode == 1
    *_, verdict, reason = done.stdout.splitlines()
    assert verdict.startswith("not equal: ")
    assert reason.startswith("mujoco is ")


def test_without_published_bits_one_line_says_so(tmp_path):
    done = check(tmp_path / "bits.json")
    assert done.returncode == 1
    assert "bits.json" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_one_bit_of_one_weight_changes_the_checksum():
    *_, state = train(small("none", iterations=1), [0], success_radius=0.02)
    weights = state.policy().weights()
    before = weights_checksum(weights)
    weights["log_std"].view(torch.int32)[0, 0] ^= 1
    assert weights_checksum(weights) != before


def test_the_smallest_block_is_published():
    published = published_bits([block("l2", 300), block("none", 200), block("l2sq", 250)])
    assert published["settings"]["cell"]["variant"]["name"] == "none"


def test_a_run_with_native_kernels_is_no_reference():
    with pytest.raises(ValueError, match="a block of l2 was made with native kernels; allowed"):
        published_bits([block(), block("l2", kernels="native")])
