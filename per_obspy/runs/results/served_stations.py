"""Stations of a run: expected, received, late and rejected, and the share of pairs of each."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.resume import StatusError, read_status


class KnownStations(NamedTuple):
    """
    Names of the expected stations, and of those with received records.

    Attributes
    ----------
    expected : tuple of str
        Names of all stations of metadata, lists of services and records, sorted.
    received : tuple of str
        Those that have records, usable or not, sorted.
    waiting : tuple of str
        Names of files that are still being written.
    """

    expected: tuple[str, ...] = ()
    received: tuple[str, ...] = ()
    waiting: tuple[str, ...] = ()

    @classmethod
    def of(
        cls, expected: Iterable[str], received: Iterable[str], waiting: Iterable[Path]
    ) -> "KnownStations":
        """Return the stations of the sources of a run; received stations count as expected."""
        names = tuple(sorted(set(received)))
        files = tuple(sorted({path.name for path in waiting}))
        return cls(tuple(sorted({*expected, *names})), names, files)


class Served(NamedTuple):
    """
    Numbers of pairs and buildings for which the record of each station is used.

    Attributes
    ----------
    pairs, buildings : mapping of str to int
        By station; buildings are known where pairs name them.
    """

    pairs: Mapping[str, int]
    buildings: Mapping[str, int]


def station_facts(
    known: KnownStations, used: Sequence[str], served: Served, counts: Mapping[str, int]
) -> dict[str, Any]:
    """
    Return the stations of a run as ``run.json`` holds them.

    Parameters
    ----------
    known : KnownStations
        Expected and received stations.
    used : sequence of str
        Stations with usable records.
    served : Served
        Pairs and buildings of each station.
    counts : mapping
        Counts of the run: ``pairs``, ``rejected_pair`` and ``buildings``.

    Returns
    -------
    dict
        ``expected``, ``received``, ``late`` (expected, without any record), ``rejected`` (of which
        no record is usable): lists of names. ``waiting``: names of files that are still being
        written. ``serves``: by station, numbers and shares of pairs and buildings.
        ``share_of_pairs``: that of all stations together. Shares are of all pairs of the
        inventory, rejected ones included, and of all buildings of its usable pairs.
    """
    pairs = counts["pairs"] + counts["rejected_pair"]
    buildings = counts.get("buildings", 0)
    # What each station serves, and its share
    serves = {}
    for name in sorted(used):
        facts = {"pairs": served.pairs.get(name, 0)}
        shares = {"share_of_pairs": _share(facts["pairs"], pairs)}
        if buildings:
            facts["buildings"] = served.buildings.get(name, 0)
            shares["share_of_buildings"] = _share(facts["buildings"], buildings)
        serves[name] = {**facts, **shares}
    # Every station is in one list beyond the expected ones
    received = {*known.received, *used}
    return {
        "expected": sorted({*known.expected, *used}),
        "received": sorted(received),
        "late": sorted({*known.expected} - received),
        "rejected": sorted(received - {*used}),
        "waiting": list(known.waiting),
        "serves": serves,
        "share_of_pairs": _share(sum(served.pairs.values()), pairs),
    }


def _share(part: int, whole: int) -> float:
    """Return part / whole, rounded; 0 if the whole is 0."""
    return round(part / whole, 6) if whole else 0.0


def earlier_facts(record: Path) -> tuple[list[Any], KnownStations]:
    """Return the earthquakes and stations in ``run.json``; empty without such a file."""
    try:
        found = read_status(record)
    except StatusError:
        return [], KnownStations()
    earthquakes, stations = found.get("earthquakes"), found.get("stations")
    # Names as the other run wrote them, if it wrote any
    known = KnownStations()
    if isinstance(stations, Mapping):
        known = KnownStations(*(_names(stations.get(name)) for name in KnownStations._fields))
    return earthquakes if isinstance(earthquakes, list) else [], known


def _names(found: object) -> tuple[str, ...]:
    """Return the names of a list in a record, none if it is damaged."""
    return tuple(
        filter(lambda name: isinstance(name, str), found if isinstance(found, list) else ())
    )
