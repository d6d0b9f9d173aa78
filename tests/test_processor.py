"""A job is told about its processor before NumPy looks at it."""

import os
import subprocess
import sys

import pytest

from reacher_shaping import processor

needs_avx2 = pytest.mark.skipif(not processor.has_avx2(), reason="this processor has no AVX2")
REPORT = """
import sys
from reacher_shaping import processor
processor.fix(sys.argv[1])
import numpy as np
import torch
from numpy._core._multiarray_umath import __cpu_features__ as features
print(processor.kernels(), processor.core_type(), torch.get_num_threads(), torch.backends.cpu.get_cpu_capability(),
      [name for name in ("X86_V4", "AVX512_ICL") if features.get(name)])
"""


def told(kernels: str, **variables: str) -> list[str]:
    command = [sys.executable, "-c", REPORT, kernels]
    done = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True, check=True)
    return done.stdout.split(maxsplit=4)


@needs_avx2
def test_portable_kernels_are_those_of_a_haswell_on_one_thread_whatever_the_environment_says():
    others = {"OPENBLAS_CORETYPE": "Sandybridge", "OMP_NUM_THREADS": "4", "ATEN_CPU_CAPABILITY": "default"}
    assert told("portable", **others) == ["portable", "Haswell", "1", "AVX2", "[]\n"]


@needs_avx2
def test_native_kernels_are_the_processors_own_on_one_thread():
    kernels, core, threads, *_ = told("native", **processor.PORTABLE, OMP_NUM_THREADS="4")
    assert (kernels, threads) == ("native", "1")
    assert core


def test_other_kernels_are_refused_naming_what_is_allowed():
    with pytest.raises(ValueError, match="kernels = 'fast'; allowed: portable, native"):
        processor.fix("fast")
