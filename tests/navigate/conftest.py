"""What many tests of sessions begin with."""

import pytest

from navigate import round_phantom


@pytest.fixture(scope="module")
def scenario():
    """ExoNav 1 among endless round walls."""
    return round_phantom.scenario()
