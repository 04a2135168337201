"""Python's search for garbage in cycles, which frees next to nothing where libraries are loaded."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def no_search() -> Iterator[None]:
    """Search no cycles while a block makes many objects that stay, as an import does."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def keep_all() -> None:
    """Leave all objects of now out of every later search, also of that at the end of a process."""
    gc.freeze()
