"""Commands in this process write short files instead of figures and pages of runs."""

from collections.abc import Iterator

import pytest

from ..runs.small_run import plain_reports


@pytest.fixture(autouse=True, scope="module")
def _plain_reports() -> Iterator[None]:
    """Write figures, PDF and page of runs as short files: tests of commands look at none."""
    with plain_reports():
        yield
