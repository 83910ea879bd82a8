"""What holds for all tests."""

import os
import signal

import pytest

# A shell starts what it puts into the background with Ctrl-C ignored; the tests of Ctrl-C need Python's own handler.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

_INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") != "0"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out what is about compiled code where nothing is compiled; play the tests of a file in one process."""
    for item in items:
        if not item.get_closest_marker("xdist_group"):  # kernels that a file's tests need are compiled once
            item.add_marker(pytest.mark.xdist_group(str(item.path)))
        if _INTERPRETED and item.get_closest_marker("compiled"):
            item.add_marker(pytest.mark.skip(reason="kernels are interpreted"))
