"""Files of settings are YAML 1.2, bounded, and refused in one line that names the file, the line and the fault."""

import math
import os

import pytest

from reacher_shaping.settings.base import ConfigError
from reacher_shaping.settings.yaml_file import check_overlays, merged, read_mapping

ALIASES = "\n".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10) if n else 'x'}]" for n in range(9))


def written(folder, text):
    path = folder / "overlay.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "value"),
    [
        # the examples of sections 10.2 and 10.3 of the specification
        ("0o7", 7), ("0x3A", 58), ("-19", -19), ("+12", 12), ("0.", 0.0), ("-0.0", -0.0), (".5", 0.5),
        ("+12e03", 12000.0), ("-2E+05", -200000.0), ("-.INF", -math.inf), ("true", True), ("FALSE", False),
        ("~", None), ("null", None), ("", None),
        # what YAML 1.1 reads as another number, a truth, a date
        ("010", 10), ("5e5", 500000.0), ("1:30.5", "1:30.5"), ("1_000", "1_000"), ("0b11", "0b11"),
        ("yes", "yes"), ("off", "off"), ("2025-01-01", "2025-01-01"), ("2025-99-99", "2025-99-99"), ("=", "="),
        ("'010'", "010"), ("!!str 10", "10"), ("!!int 10", 10),
    ],
)  # fmt: skip
def test_plain_scalars_are_those_of_the_core_schema(tmp_path, text, value):
    found = read_mapping(written(tmp_path, f"key: {text}"))["key"]
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: 1\nb: {c: 1, c: 2}", ["line 2", "'c' is there twice"]),
        ("a: !!int abc", ["line 1", "'abc' is no int"]),
        ("a: !!bool maybe", ["'maybe' is no bool"]),
        ("a: !!timestamp x", ["timestamp"]),
        ("a: !!python/object/apply:os.getcwd []", ["python/object"]),
        (f"a: {'9' * 10_000}", ["line 1", "is no int of at most 40 characters"]),
        (f"a: {'[' * 3000}{']' * 3000}", ["nested too deep", "20 levels"]),
        (f"a: {'[' * 30}{']' * 30}", ["nested too deep", "20 levels"]),
        ("a: &a [*a]", ["nested too deep"]),
        (ALIASES, ["aliases", "100000"]),
        (f"a: '{'x' * 10**6}'", ["too large", "1000000 bytes"]),
        ("a: [", ["line 1"]),
    ],
)
def test_what_is_no_settings_file_is_refused_in_one_line_at_once(tmp_path, text, words):
    path = written(tmp_path, text)
    with pytest.raises(ConfigError) as refused:
        read_mapping(path)
    message = str(refused.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    assert len(message) < 300
    for word in words:
        assert word in message


@pytest.mark.parametrize("text", ["", "a: [", "- a", '"\\e[1m": 1\n"\\e[1m": 2', "a: !%1b[1m x", "a: \x1b[1m"])
def test_names_and_contents_that_steer_a_terminal_are_spelt_out(tmp_path, text):
    path = tmp_path / "\x1b[31m.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as refused:
        read_mapping(path)
    assert str(refused.value).isprintable()
    assert r"\x1b[31m.yaml" in str(refused.value)


def test_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(ConfigError, match=r"pipe\.yaml: is no file; allowed: a file of settings"):
        read_mapping(tmp_path / "pipe.yaml")


def test_an_alias_is_what_it_stands_for(tmp_path):
    assert read_mapping(written(tmp_path, "a: &few [1, 2]\nb: *few")) == {"a": [1, 2], "b": [1, 2]}


def test_a_file_laid_over_another_changes_what_it_names():
    base = {"a": {"b": 1, "c": [1, 2]}, "d": 0}
    assert merged(base, {"a": {"c": [3]}}, {"d": {"e": 1}}) == {"a": {"b": 1, "c": [3]}, "d": {"e": 1}}
    assert base == {"a": {"b": 1, "c": [1, 2]}, "d": 0}


@pytest.mark.parametrize("option", ["--configfile", "--configfiles"])
def test_an_overlay_that_snakemake_would_crash_on_is_refused_before_it_reads_it(tmp_path, option):
    path = written(tmp_path, "title: 2025-99-99")
    assert read_mapping(path) == {"title": "2025-99-99"}
    with pytest.raises(SystemExit, match=r"line 1.*'2025-99-99' for timestamp"):
        check_overlays(["snakemake", "-n", "--config", "seeds=2", option, str(path), "--", "all"])
    check_overlays(["snakemake", "-n", "--config", "seeds=2"])
