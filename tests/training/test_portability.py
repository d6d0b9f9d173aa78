"""A job has the same bits on every processor: under other environments, and on processors that qemu emulates."""

import io
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import torch

from reacher_shaping import processor

pytestmark = pytest.mark.slow

TESTS = Path(__file__).parents[1]
JOB = """
import sys
from pathlib import Path
from reacher_shaping import processor
processor.fix(sys.argv[2])
from cells import small
from reacher_shaping.evaluation.evaluate import Conditions, evaluate
from reacher_shaping.jobs import training_job
from reacher_shaping.storage.policy_format import write_policy
path = Path(sys.argv[1])
for variant, changes in (("l2", {}), ("decay", {"networks": "separate", "initialisation": "orthogonal"})):
    cell = small(variant, iterations=2, **changes)
    block = path / f"{variant}-block"
    with training_job.trained_block(cell, [0, 1], success_radius=0.02, folder=block, report=print) as (state, _):
        policy = state.policy()
        write_policy(path / f"{variant}.pt", state.seeds, policy.weights(), {})
        state.progress_frame().to_parquet(path / f"{variant}-progress.parquet")
        met = Conditions(environment=cell.protocol.environment, root_seed=1, success_radius=0.02, episodes=10)
        episodes = evaluate(policy.act, state.seeds, met)
        episodes.to_parquet(path / f"{variant}-episodes.parquet")
"""
EMULATED = ("Haswell-v4", "Skylake-Client", "EPYC-v3")
needs_avx2 = pytest.mark.skipif(not processor.has_avx2(), reason="this processor has no AVX2: its bits are its own")
needs_qemu = pytest.mark.skipif(not shutil.which("qemu-x86_64"), reason="no qemu-x86_64 (Debian: qemu-user)")


def job(folder: Path, *, kernels: str = "portable", cpu: str = "", **variables: str) -> dict[str, bytes]:
    """The files of a job, on an emulated processor if `cpu` names one."""
    folder.mkdir()
    paths = [str(TESTS), str(TESTS.parent / "src"), sysconfig.get_path("purelib"), *filter(None, sys.path)]
    emulator = ["qemu-x86_64", "-cpu", cpu] if cpu else []
    command = [*emulator, os.path.realpath(sys.executable), "-W", "ignore", "-c", JOB, str(folder), kernels]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)} | variables
    subprocess.run(command, env=environment, check=True, timeout=1800)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The files of a job with nothing special about it."""
    return job(tmp_path_factory.mktemp("made") / "job")


def test_a_job_takes_no_thread_and_no_kernel_from_its_environment(made, tmp_path):
    assert len(made) == 6
    others = {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "OPENBLAS_CORETYPE": "Sandybridge"}
    assert job(tmp_path / "job", **others, ATEN_CPU_CAPABILITY="default", NPY_DISABLE_CPU_FEATURES="X86_V3") == made


def test_native_kernels_change_rounding_only(made, tmp_path):
    """Training amplifies rounding: 1e-7 here, after two short iterations, is another sample after a whole run."""
    native = job(tmp_path / "job", kernels="native")
    for name in ("l2.pt", "decay.pt"):
        ours, theirs = (torch.load(io.BytesIO(files[name]), weights_only=True)["weights"] for files in (made, native))
        for key, tensor in ours.items():
            torch.testing.assert_close(tensor, theirs[key], rtol=0, atol=1e-5)


@needs_avx2
@needs_qemu
@pytest.mark.parametrize("cpu", EMULATED)
def test_a_job_has_the_same_bytes_on_another_processor(made, tmp_path, cpu):
    assert job(tmp_path / "job", cpu=cpu) == made
