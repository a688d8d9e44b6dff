"""What a test needs of the machine. Whether it is there is asked in one place for all tests: cmake/capabilities.py."""
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cmake"))
import capabilities  # noqa: E402


def need(name):
    """Skips the test where this machine lacks it. A test that skips for what the machine has fails the run."""
    reason = capabilities.lacks(name)
    if reason is not None:
        pytest.skip(f"needs {name}: {reason}")
