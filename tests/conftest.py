"""The tests compute as the study's jobs do: on one thread, with kernels that round alike on all processors."""

from pathlib import Path

import pytest

from reacher_shaping import processor

processor.fix()


UNSETTLED = tuple(
    line for line in (Path(__file__).parent / "unsettled.txt").read_text().splitlines() if line and line[0] != "#"
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests named in `unsettled.txt`: they run, and one that passes again is an error."""
    for item in items:
        if item.nodeid.startswith(UNSETTLED):
            item.add_marker(pytest.mark.xfail(reason="named in tests/unsettled.txt", strict=True))
