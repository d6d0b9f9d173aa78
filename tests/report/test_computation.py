"""What the report says of how a study was computed."""

import pytest

from reacher_shaping.report import computation

MANIFEST = {
    "git": {"commit": "c" * 40, "dirty": False},
    "machine": {"processor": "Xeon", "cores": 2},
    "threads": 1,
    "env_steps": 4096,
    "wall_seconds": 2.0,
    "cpu_seconds": 1.5,
    "env_steps_per_second": 2048.0,
    "versions": {"mujoco": "3.17.0", "pandas": "3.0"},
}


@pytest.mark.parametrize(
    ("versions", "told"),
    [
        ({"mujoco": "3.17.0", "pandas": "3.0"}, None),
        ({"mujoco": "3.17.0", "pandas": "3.1"}, None),  # no weight hangs on pandas
        ({"mujoco": "3.3.7", "pandas": "3.0"}, "mujoco 3.17.0 and 3.3.7"),
    ],
)
def test_blocks_of_versions_with_other_bits_are_told_in_the_report(versions, told):
    rows = dict(computation.grid([MANIFEST, MANIFEST | {"versions": versions}]).rows)
    if told is None:
        assert "Bits" not in rows
    else:
        assert rows["Bits"].endswith(told)
        assert "no one machine makes all of them again" in rows["Bits"]
    assert rows["Environment steps"] == "8,192"


def test_speed_is_the_median_of_the_jobs_with_the_slowest_and_the_fastest():
    jobs = [MANIFEST | {"env_steps_per_second": speed} for speed in (1000.0, 9000.0, 2000.0, 4000.0)]
    rows = dict(computation.grid(jobs).rows)
    assert rows["Steps per second of a job"] == "3,000 (median; 1,000 to 9,000)"
