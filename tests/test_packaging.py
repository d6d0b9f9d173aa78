"""What is declared fits together: pins, the lock file, the package's metadata."""

import re
import tomllib
from pathlib import Path

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


def test_type_hints_are_marked_as_public():
    assert (ROOT / "src" / "reacher_shaping" / "py.typed").exists()
