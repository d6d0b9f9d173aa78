"""Which bits hold where: training in fresh processes under other threads, vector units and modes of MKL."""

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

TRAIN = """
import sys
import torch
torch.set_num_threads(int(sys.argv[2]))
from cells import small
from reacher_shaping.train import train
*_, state = train(small("l2", iterations=3), [0, 1], radius=0.02)
state.rows.numpy().tofile(sys.argv[1])
"""
FLAGS = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
needs_avx2 = pytest.mark.skipif(" avx2 " not in FLAGS, reason="sets modes of x86 processors with AVX2")


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A function that trains under environment variables and gives the weights."""
    folder = tmp_path_factory.mktemp("trained")

    @cache
    def weights(*variables: str, threads: int = 1) -> np.ndarray:
        path = folder / "-".join([*variables, str(threads)])
        environment = os.environ | {"OMP_NUM_THREADS": str(threads)} | dict(pair.split("=") for pair in variables)
        command = [sys.executable, "-c", TRAIN, str(path), str(threads)]
        subprocess.run(command, env=environment, cwd=Path(__file__).parent, check=True)
        return np.fromfile(path, dtype=np.float32)

    return weights


def test_two_threads_change_no_bit(trained):
    assert trained().size > 10_000
    assert np.array_equal(trained(), trained(threads=2))


@needs_avx2
def test_pytorchs_own_kernels_give_the_same_bits_with_avx2_and_avx512(trained):
    assert np.array_equal(trained(), trained("ATEN_CPU_CAPABILITY=avx2"))


@needs_avx2
def test_one_mode_of_the_matrix_library_gives_the_same_bits_on_newer_processors(trained):
    """MKL's conditional numerical reproducibility: with it, a processor with AVX-512 computes as one with AVX2."""
    older = trained("MKL_ENABLE_INSTRUCTIONS=AVX2", "MKL_CBWR=AVX2")
    assert np.array_equal(trained("MKL_CBWR=AVX2"), older)


@needs_avx2
@pytest.mark.parametrize("variables", [("MKL_CBWR=COMPATIBLE",), ("ATEN_CPU_CAPABILITY=default",)])
def test_other_vector_units_change_rounding_only(trained, variables):
    """Training amplifies rounding: 1e-7 here, after three short iterations, is another sample after a whole run."""
    np.testing.assert_allclose(trained(*variables), trained(), rtol=0, atol=1e-5)
