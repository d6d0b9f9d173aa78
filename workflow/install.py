"""Install the pinned packages into the environment of this Python: PyTorch as its CPU build, all others by checksum.

    python workflow/install.py [--any-torch]

PyTorch has builds for many machines under one version, so it alone has no checksum in requirements.txt. Where the
package index offers only the build for GPUs, with 4 GB of packages that nothing here uses, uv gets the CPU build from
PyTorch's own index; where that cannot be reached, the installation ends with one line, unless `--any-torch` is given.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PIP = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]


def pinned_torch() -> str:
    """`torch==2.13.0`, as pyproject.toml pins it."""
    pin = re.search(r'"(torch==[\w.]+)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert pin, "pyproject.toml pins torch"
    return pin[1]


def brings_gpu_packages(requirement: str) -> bool:
    """Whether pip would install packages of NVIDIA with it."""
    command = [*PIP, "install", "--dry-run", "--report", "-", requirement]
    report = json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)
    return any(package["metadata"]["name"].startswith("nvidia") for package in report["install"])


def install_cpu_torch(requirement: str) -> bool:
    """Try to install PyTorch's CPU build with uv; return whether it is there."""
    command = [sys.executable, "-m", "uv", "pip", "install", "--no-config", "--quiet", "--python", sys.executable]
    return subprocess.run([*command, "--torch-backend", "cpu", requirement], check=False).returncode == 0


def main(any_torch: bool) -> None:
    """Install everything, or end with one line that says what cannot be had."""
    requirement = pinned_torch()
    subprocess.run([*PIP, "install", "--no-deps", "--require-hashes", "-r", ROOT / "requirements.txt"], check=True)
    if any_torch or not brings_gpu_packages(requirement):
        subprocess.run([*PIP, "install", requirement], check=True)
    elif not install_cpu_torch(requirement):
        sys.exit(
            f"{requirement}: for Python {sys.version_info.major}.{sys.version_info.minor} only the build for GPUs is "
            "offered here, with 4 GB of packages that nothing uses, and PyTorch's own index of CPU builds cannot be "
            "reached. "
            "Name another Python (make setup PYTHON=python3.11), or take it: make setup ANY_TORCH=yes"
        )


if __name__ == "__main__":
    try:
        main("--any-torch" in sys.argv[1:])
    except subprocess.CalledProcessError as error:
        sys.exit(f"{' '.join(map(str, error.cmd[2:5]))} failed with code {error.returncode}; its reason stands above")
