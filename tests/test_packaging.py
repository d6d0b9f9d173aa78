"""What is declared fits together: pins, the lock file, the package's metadata."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
LOCK = (ROOT / "requirements.txt").read_text()


def name(requirement: str) -> str:
    return re.split(r"[=\[<>;~! ]", requirement, maxsplit=1)[0].lower().replace("_", "-")


def test_lock_file_has_every_pin_and_a_checksum_of_each_package():
    locked = {line.split(";")[0].split("\\")[0].strip().lower() for line in LOCK.splitlines() if line[:1].isalnum()}
    pins = {pin.lower() for pin in PROJECT["dependencies"] + PROJECT["optional-dependencies"]["dev"]}
    missing = {pin for pin in pins if re.sub(r"\[.*?\]", "", pin) not in locked}
    assert {name(pin) for pin in missing} == {"torch"}, "run `make lock`"
    packages = re.split(r"^(?=\w)", LOCK, flags=re.MULTILINE)[1:]
    assert all("--hash=sha256:" in package for package in packages)


def test_lock_file_brings_no_packages_for_gpus():
    assert not re.findall(r"^(?:nvidia|cuda|triton|torch)\S*", LOCK, flags=re.MULTILINE)


def test_every_dependency_is_pinned():
    pins = PROJECT["dependencies"] + PROJECT["optional-dependencies"]["dev"]
    assert [pin for pin in pins if "==" not in pin] == []


# Extras whose packages a folder may import, beside those of every installation.
EXTRAS = {
    "src": ["s3"],
    "workflow": [],
    "tests": ["dev", "bench", "slurm", "s3", "s3-tests"],
    "benchmarks": ["dev", "bench"],
}
PACKAGE = {
    "yaml": "pyyaml",
    "PIL": "pillow",
    "sbx": "sbx-rl",
    "vl_convert": "vl-convert-python",
    "markupsafe": "jinja2",  # comes with it, as the next ones with theirs
    "IPython": "ipykernel",
    "glfw": "mujoco",
    "traitlets": "papermill",
    "boto3": "snakemake-storage-plugin-s3",
    "werkzeug": "moto",
}
"""The package that brings a module, where it is not called as the module is."""
OWN = {path.stem for folder in EXTRAS for path in (ROOT / folder).rglob("*") if path.is_dir() or path.suffix == ".py"}
NO_IMPORT = {"imageio", "pandas-stubs", "types-pyyaml"}
"""Packages that others read: Gymnasium's environments, and the type checker."""


def imported(folder: str) -> set[str]:
    """The packages whose modules the Python files of a folder import, or ask pytest for."""
    modules = set()
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                modules.add(node.module)
            elif isinstance(node, ast.Call) and ast.unparse(node.func) == "pytest.importorskip":
                modules.add(ast.literal_eval(node.args[0]))
    firsts = {module.split(".")[0] for module in modules}
    others = firsts - OWN - sys.stdlib_module_names
    return {PACKAGE.get(module, module.replace("_", "-")) for module in others}


@pytest.mark.parametrize("folder", EXTRAS)
def test_every_import_is_of_a_declared_package(folder):
    extras = PROJECT["optional-dependencies"]
    declared = {name(pin) for pins in (PROJECT["dependencies"], *map(extras.get, EXTRAS[folder])) for pin in pins}
    assert imported(folder) - declared == set()


def test_every_dependency_is_used():
    files = ["Makefile", ".pre-commit-config.yaml", "workflow/install.py", "workflow/notebooks/correlation.py"]
    words = " ".join((ROOT / file).read_text(encoding="utf-8") for file in files)
    for option, package in (("kernelspec", "ipykernel"), ("--numprocesses", "pytest-xdist")):
        words = words.replace(option, package)
    used = NO_IMPORT.union(*map(imported, EXTRAS), re.findall(r"[\w-]+", words))
    declared = {name(pin) for pin in PROJECT["dependencies"] + PROJECT["optional-dependencies"]["dev"]}
    assert declared - used == set()


def test_type_hints_are_marked_as_public():
    assert (ROOT / "src" / "reacher_shaping" / "py.typed").exists()
