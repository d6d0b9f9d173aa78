"""What a job does with its processor: one thread, and instructions that every x86-64 processor with AVX2 has.

NumPy, its matrix library OpenBLAS and PyTorch choose their fastest kernels for the processor at hand, and other kernels
round otherwise, which training amplifies. So they are told that it is a Haswell, the oldest with AVX2: then a result
has the same bits on all that have it. They look once, when they are imported, so the environment must say it before.
"""

import ctypes
import os
import platform
from pathlib import Path

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
PORTABLE = {
    "OPENBLAS_CORETYPE": "Haswell",  # matrix products of NumPy and SciPy
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",  # NumPy's functions
    "ATEN_CPU_CAPABILITY": "avx2",  # PyTorch's own kernels
}
KERNELS = ("portable", "native")
"""Kernels with the same bits everywhere, or the fastest ones of this processor: a setting of the machine."""


def fix(kernels: str = "portable") -> None:
    """Set the environment of this process, if it has not imported NumPy yet, and of all that it starts.

    A processor without AVX2 has its native kernels only. Raises ValueError for other `kernels` than `KERNELS`.
    """
    if kernels not in KERNELS:
        raise ValueError(f"kernels = {kernels!r}; allowed: {', '.join(KERNELS)}")
    os.environ.update(ONE_THREAD)
    for name in PORTABLE:
        os.environ.pop(name, None)
    if kernels == "portable" and has_avx2():
        os.environ.update(PORTABLE)


def kernels() -> str:
    """Return which of `KERNELS` the environment says."""
    return "portable" if PORTABLE.items() <= os.environ.items() else "native"


def core_type() -> str:
    """Return the processor whose matrix products NumPy's OpenBLAS computes with, as it says itself; or nothing."""
    import numpy as np

    for library in (Path(np.__file__).parents[1] / "numpy.libs").glob("libscipy_openblas64_*"):
        tell = getattr(ctypes.CDLL(str(library)), "scipy_openblas_get_corename64_", None)
        if tell:
            tell.restype = ctypes.c_char_p
            return str(tell().decode())
    return ""


def has_avx2() -> bool:
    """Return whether this is an x86-64 processor with AVX2."""
    flags = Path("/proc/cpuinfo")
    return platform.machine() == "x86_64" and (not flags.exists() or " avx2 " in flags.read_text())
