"""How long work tells where it is: a function that is called with a stage's name, what is done of it, and its size."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]


def silent(stage: str, done: int, total: int) -> None:
    """Tell nobody."""
