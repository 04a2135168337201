"""
Record of a run, ``run.json``: filled in the order of the stages, and written last.

The state is ``unfinished`` from the beginning to the end: only then the other results are complete,
and a run of the same inputs is up to date.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

from per_obspy.files import remove_file
from per_obspy.results.ranked_table import remove_table
from per_obspy.resume import StatusError, read_status
from per_obspy.runs.losses import number_of_rows
from per_obspy.runs.output_folder import RECORD, UNFINISHED, Result, now, recorded
from per_obspy.runs.tasks.executor import engine_facts


@dataclass(frozen=True, kw_only=True)
class RunRecord:
    """Content of ``run.json`` by its keys; values of stages that have not begun are None."""

    #: Title of the run; ``unfinished``, ``complete``, or ``nothing_usable`` without any pair.
    name: str
    state: str = UNFINISHED
    #: Stage of an unfinished run.
    stage: str | None = None
    #: Rows of the pair tables in the run before, of an unfinished run.
    earlier_rows: int | None = None
    #: Whether anything is rejected; whether some work failed, so that the next run does it again.
    partial: bool | None = None
    failed: bool | None = None
    #: Stations, pairs, states, rejections, chunks and rows.
    counts: Mapping[str, int] | None = None
    #: Figures and layers that could not be made.
    faults: Sequence[str] | None = None
    #: Level and sentence of the result.
    alert: str | None = None
    #: Workers and events of a cluster.
    engine: Mapping[str, Any] | None = None
    #: Whether any motion is simulated.
    simulated: bool | None = None
    #: Flag -> names of the used stations that have it.
    warnings: Mapping[str, Sequence[str]] | None = None
    #: Sentences on the pair tables; their rows, and those that are left out.
    pair_tables: Mapping[str, Any] | None = None
    coverage: Mapping[str, Any] | None = None
    #: Version of every library on which results depend.
    versions: Mapping[str, str] | None = None
    #: Time of each stage.
    seconds: dict[str, float] = field(default_factory=dict)
    #: Facts of every earthquake of the records.
    earthquakes: Sequence[Any] = ()
    #: Trusted stations, see ``ComparedStations``.
    trusted: Mapping[str, Sequence[str]] | None = None
    #: See :func:`station_facts`.
    stations: Mapping[str, Any] | None = None
    #: Hashes of the files of the first stage.
    intermediate: Mapping[str, str] | None = None
    #: Time, ISO 8601, UTC.
    started: str = field(default_factory=now)
    #: Numbers of pairs and rejections of a search in footprints.
    drawn: Mapping[str, int] = field(default_factory=dict)
    #: Sentences on rows that are lost.
    losses: Sequence[str] | None = None
    #: Settings; hash of every input file.
    configuration: Mapping[str, Any] | None = None
    inputs: Mapping[str, str] | None = None
    #: Hash of every file of the results.
    outputs: Mapping[str, str] = field(default_factory=dict)
    #: Further plain values, which change no result.
    facts: Mapping[str, object] = field(default_factory=dict)

    def write(self, folder: Path, key: str = "") -> Result:
        """Write the record; without a key the next run does everything again."""
        own = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "facts"}
        known = {name: value for name, value in own.items() if value is not None}
        return recorded(folder / RECORD, {**self.facts, **known, "key": key})

    def begin(self, folder: Path, stage: str) -> Self:
        """Write the record of a run that begins a stage, and remove what is not of this run."""
        begun = replace(self, stage=stage, earlier_rows=number_of_rows(folder / RECORD))
        begun.write(folder)
        # A table of an earlier run would be taken for one of this run
        remove_table(folder)
        for name in ("risk", "rows", "buildings"):
            for end in (".parquet", ".csv", ".columns.csv"):
                remove_file(folder / f"{name}{end}")
        return begun

    @contextmanager
    def with_engine(self, folder: Path, executor: Executor | None) -> Iterator[None]:
        """Add workers and events of a cluster to the record, also if an error ends the run."""
        try:
            yield
        finally:
            if facts := engine_facts(executor):
                # The error that ended the run counts
                with suppress(OSError):
                    replace(self, engine=facts).write(folder)


class KnownStations(NamedTuple):
    """Names of the expected stations, and of those with received records."""

    #: Names of all stations of metadata, lists of services and records, sorted.
    expected: tuple[str, ...] = ()
    #: Those that have records, usable or not, sorted.
    received: tuple[str, ...] = ()
    #: Names of files that are still being written.
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
    """Numbers of pairs and buildings for which the record of each station is used."""

    #: By station; buildings are known where pairs name them.
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
