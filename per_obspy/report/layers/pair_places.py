"""Columns of the places of both buildings of a pair."""

from collections.abc import Iterable

#: Longitude and latitude of both buildings.
BOTH_PLACES = ("longitude_1", "latitude_1", "longitude_2", "latitude_2")


def has_both_places(columns: Iterable[str]) -> bool:
    """Return whether a table has the places of both buildings."""
    return set(BOTH_PLACES) <= set(columns)
