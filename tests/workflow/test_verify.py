"""`make verify`: files that are not what their manifests say are named."""

import subprocess
import sys
from pathlib import Path

import pytest

from reacher_shaping.storage.files import sha256, write_json, write_text

SCRIPT = Path(__file__).parents[2] / "workflow" / "verify.py"


@pytest.fixture
def block(tmp_path):
    folder = tmp_path / "results" / "paper" / "l2" / "4096" / "alpha1" / "seeds0-1"
    write_text(folder / "policy.pt", "weights")
    write_text(folder / "monitor" / "0.monitor.csv", "r,l,t")
    names = ["policy.pt", "monitor/0.monitor.csv"]
    outputs = {name: sha256(folder / name) for name in names}
    write_json(folder / "manifest.json", {"outputs": outputs})
    return folder


def verify(block):
    done = subprocess.run([sys.executable, SCRIPT, block.parents[5]], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    return done.returncode, done.stdout.strip().splitlines()


def test_untouched_files_pass(block):
    code, said = verify(block)
    assert code == 0
    assert said[0].startswith(f"The files of 1 seed blocks in {block.parents[4]} are as they were made; tables")
    assert "were not checked" in said[0]


@pytest.mark.parametrize("name", ["policy.pt", "monitor/0.monitor.csv"])
def test_a_changed_byte_is_named(block, name):
    content = bytearray((block / name).read_bytes())
    content[1] ^= 1
    (block / name).write_bytes(content)
    code, said = verify(block)
    assert code == 1
    assert len(said) == 1
    assert said[0].startswith(f"{block / name}: has changed")


def test_a_missing_file_is_named(block):
    (block / "policy.pt").unlink()
    assert verify(block) == (1, [f"{block / 'policy.pt'}: is missing; snakemake makes it again"])


def test_a_missing_manifest_is_named(block):
    (block / "manifest.json").unlink()
    assert verify(block) == (1, [f"{block / 'manifest.json'}: is missing; snakemake makes it again"])


@pytest.mark.parametrize("content", ["", "{", "[1]", "{}", '{"outputs": []}'])
def test_a_damaged_manifest_is_named(block, content):
    (block / "manifest.json").write_text(content)
    code, said = verify(block)
    assert code == 1
    assert len(said) == 1
    assert str(block / "manifest.json") in said[0]


def test_changed_reference_run_is_named_without_a_study_too(tmp_path):
    kept = tmp_path / "report" / "reference"
    write_text(kept / "claims.csv", "as kept")
    write_json(kept / "manifest.json", {"tables": {"claims.csv": sha256(kept / "claims.csv")}})
    write_text(kept / "claims.csv", "edited")
    done = subprocess.run([sys.executable, SCRIPT, tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert f"{kept / 'claims.csv'}: has changed since it was made" in done.stdout


def test_no_results_are_nothing_to_believe(tmp_path):
    done = subprocess.run([sys.executable, SCRIPT, tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stdout == f"{tmp_path / 'results'}: holds no seed blocks; run the study first: make reproduce\n"
