"""Which bits hold where: training jobs in fresh processes under other threads, vector units and modes of MKL."""

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow

JOB = """
import sys
from pathlib import Path
import torch
from cells import small
from reacher_shaping.jobs import training_job
path = Path(sys.argv[1])
cell = small("l2", iterations=3)
with training_job.trained_block(cell, [0, 1], radius=0.02, folder=path / "checkpoint", report=print) as (state, _):
    assert torch.get_num_threads() == 1, "a job is one thread"
    state.rows.numpy().tofile(path / "weights")
"""
FLAGS = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
needs_avx2 = pytest.mark.skipif(" avx2 " not in FLAGS, reason="sets modes of x86 processors with AVX2")


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A function that trains under environment variables and gives the weights."""
    folder = tmp_path_factory.mktemp("trained")

    @cache
    def weights(*variables: str) -> np.ndarray:
        path = folder / "-".join(["job", *variables])
        path.mkdir()
        environment = os.environ | {"OMP_NUM_THREADS": "1"} | dict(pair.split("=") for pair in variables)
        subprocess.run(
            [sys.executable, "-c", JOB, str(path)], env=environment, cwd=Path(__file__).parents[1], check=True
        )
        return np.fromfile(path / "weights", dtype=np.float32)

    return weights


def test_a_job_gives_the_same_bits_whatever_number_of_threads_its_environment_names(trained):
    """Because it runs on one: PyTorch's sums over two threads have other last bits on some processors."""
    assert trained().size > 10_000
    assert np.array_equal(trained(), trained("OMP_NUM_THREADS=2"))


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
