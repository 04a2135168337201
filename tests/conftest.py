"""What several test modules share: where the real records are."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# The first example of a test may compile a kernel, which takes seconds. In CI every run tries the same examples, so
# that a change is judged by itself; elsewhere each run tries new ones.
settings.register_profile("compiling", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("compiling")

CHECKOUT = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of real records: PER_OBSPY_DATA, or ``shared/data`` beside the checkout."""
    folder = Path(os.environ.get("PER_OBSPY_DATA", CHECKOUT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real records are not at {folder}: set PER_OBSPY_DATA")
    return folder
