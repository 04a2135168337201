"""Description of an input: a title, one line per fact, and places for a map."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

Places = tuple[Sequence[float], Sequence[float]]


class Facts(NamedTuple):
    """
    Description of an input.

    Attributes
    ----------
    kind : str
        Kind of the input in words.
    title : str
        Its size in a few words.
    lines : list of tuple of str
        Label and text of every fact.
    places : dict
        Sign on the map -> longitudes and latitudes, degrees; the empty sign is drawn by numbers.
    values : dict
        Plain values, for machines.
    usable : bool
        Whether anything in it can be used.
    """

    kind: str
    title: str
    lines: list[tuple[str, str]]
    places: dict[str, Places]
    values: dict[str, Any]
    usable: bool = True


def span(values: Iterable[float], unit: str = "") -> str:
    """
    Return the range of the finite numbers as text.

    Examples
    --------
    >>> span([0.01, 0.02], "s"), span([5.0, 5.0], "m"), span([], "m")
    ('0.01 to 0.02 s', '5 m', 'unknown')
    """
    known = [value for value in values if value == value]
    if not known:
        return "unknown"
    ends = list(dict.fromkeys(f"{end:.4g}" for end in (min(known), max(known))))
    return f"{' to '.join(ends)} {unit}".strip()


def some(names: Sequence[str], count: int = 6) -> str:
    """
    Return the first names, and the number of the others, as text.

    Examples
    --------
    >>> some(["a", "b", "c"], 2), some([])
    ('a, b and 1 more', 'none')
    """
    more = f" and {len(names) - count} more" if len(names) > count else ""
    return ", ".join(names[:count]) + more or "none"


def unzipped(places: Sequence[tuple[float, float]]) -> Places:
    """
    Return the longitudes and the latitudes of places.

    Examples
    --------
    >>> unzipped([(1.0, 2.0), (3.0, 4.0)])
    ([1.0, 3.0], [2.0, 4.0])
    """
    longitudes = [longitude for longitude, _ in places]
    return longitudes, [latitude for _, latitude in places]
