"""Fixtures of the tests of runs."""

from collections.abc import Iterator

import pytest

from .small_run import plain_figures as with_plain_figures


@pytest.fixture(scope="module")
def plain_figures() -> Iterator[None]:
    """Write figures and PDF of all runs of a module as short files: its tests look at tables."""
    with with_plain_figures():
        yield
