"""
Coverage of a screening: rows of the pair tables, those with a verdict, and why others have none.

One place counts it, from rejections that are read one by one, for console, page, summaries and
``run.json``. The search for neighbours in outlines leaves pairs out too: its account goes with the
pair table, in the metadata of Parquet or as the table of rejections next to a CSV file.
"""

import csv
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from per_obspy.errors import Rejection, shortened

#: Key of the account of the search in the metadata of a Parquet file.
METADATA = b"per_obspy_search"

#: Share of rows without a verdict from which a screening says so first.
MANY = 1.0 / 3.0

#: Kinds of reasons that are kept apart, and areas that are named.
MOST_KINDS, MOST_AREAS = 12, 3

#: Kind of all reasons beyond those that are kept apart.
OTHERS = "other reasons"

#: Beginnings or parts of reasons, and their kinds. The kind of a row is that of its first reason;
#: the map, where there is one, is asked after all stations and decides.
_KINDS = (
    (r"ShakeMap has no motion", "no motion on the ShakeMap"),
    (r"outside the ShakeMap", "outside the ShakeMap"),
    (r"are outside the amplitudes'", "outside the periods of station amplitudes"),
    (r"^nearest amplitudes ", "no station within reach"),
    (r"^none of height", "no height, storeys or period"),
    (r"^nearest station ", "no station within reach"),
    (r"^no station has coordinates", "no station with coordinates"),
    (r"outside the spectrum", "outside the spectrum"),
    (r"^footprints overlap", "footprints overlap"),
    (r"^no geometry", "no outline"),
    (r"^the polygon is invalid", "invalid outline"),
    (r"occurs in an earlier|repeats an earlier", "repeated"),
    (r"makes floors of", "height and storeys disagree"),
    (r"is above the lower building", "contact height above the lower building"),
    (r"is a placeholder", "position 0, 0"),
    (r"^the positions .* apart", "positions too far apart"),
    (r"has no gap to itself", "a building paired with itself"),
    (r"^\d+ columns, the header has|has a line break", "broken line"),
    (r" in one scenario and ", "scenarios disagree"),
)  # fmt: skip

#: Faults of one cell, after the name of its column.
_CELL = re.compile(
    r"(?P<column>[a-z][a-z_]*?)(?:_[12])?(?: = .*?)? is "
    r"(?P<fault>empty|not a number|no number|no length|outside|unknown)\b"
)
_FAULTS = {
    "empty": "empty",
    "not a number": "no number",
    "no number": "no number",
    "no length": "no number",
    "outside": "out of range",
    "unknown": "unknown word",
}


def kind_of(reasons: Sequence[str]) -> str:
    """
    Return the kind of a rejection, a few words without its values.

    Examples
    --------
    >>> kind_of(["storeys_1 = 900 is outside 1 to 200", "gap is empty"])
    'storeys: out of range'
    >>> kind_of(["nearest station XX.A is 90000 m away, beyond 30000 m"])
    'no station within reach'
    """
    first = reasons[0] if reasons else ""
    # Two kinds concern the map, which is asked last
    for number, (pattern, kind) in enumerate(_KINDS):
        if any(re.search(pattern, reason) for reason in (reasons if number < 2 else [first])):
            return kind
    if cell := _CELL.match(first):
        return f"{cell['column']}: {_FAULTS[cell['fault']]}"
    # Another sentence without the values in it
    plain = re.sub(r"'[^']*'|\"[^\"]*\"|[-+]?\d[\d.e+-]*", "…", first)
    return shortened(plain, 60) or OTHERS


@dataclass(frozen=True)
class Search:
    """Account of a search for neighbours in outlines."""

    #: Pairs in its table.
    pairs: int = 0
    #: Neighbours that are not in the table, by kind, most first.
    left_out: Mapping[str, int] = field(default_factory=dict)
    #: Features of the layer that are no usable building, by kind, most first.
    buildings: Mapping[str, int] = field(default_factory=dict)
    #: Areas with most neighbours left out.
    areas: Sequence[tuple[str, int]] = ()
    #: Sources of the outlines whose licence forbids commercial use, with the licence.
    restricted: Sequence[str] = ()

    @property
    def neighbours(self) -> int:
        """Return the number of neighbouring pairs in the outlines."""
        return self.pairs + sum(self.left_out.values())

    def joined(self, other: "Search") -> "Search":
        """Return the account of two searches together."""
        return Search(
            self.pairs + other.pairs,
            most_first(Counter(self.left_out) + Counter(other.left_out)),
            most_first(Counter(self.buildings) + Counter(other.buildings)),
            [*self.areas, *other.areas][:MOST_AREAS],
            sorted({*self.restricted, *other.restricted}),
        )


@dataclass(frozen=True)
class Coverage:
    """Rows of the pair tables of a screening, and those that have a verdict."""

    #: Rows of the pair tables, and those in the table of results.
    rows: int
    screened: int
    #: The others by kind of their reason, most first.
    left_out: Mapping[str, int] = field(default_factory=dict)
    #: Areas with most rows left out, as far as their coordinates are known.
    areas: Sequence[tuple[str, int]] = ()
    #: The search that made the pair table; None if no account is at hand.
    search: Search | None = None

    @property
    def pairs(self) -> int:
        """Return the number of neighbouring pairs that might have a verdict."""
        return max(self.rows, self.search.neighbours) if self.search else self.rows

    @property
    def lacks_many(self) -> bool:
        """Return whether a third of the pairs or more have no verdict."""
        return self.pairs > 0 and self.pairs - self.screened >= MANY * self.pairs

    def as_record(self) -> dict[str, Any]:
        """Return the coverage as ``run.json`` holds it."""
        record: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        return record

    @classmethod
    def of_record(cls, record: Mapping[str, Any]) -> Self:
        """Return the coverage in ``run.json``; of an older one as far as its counts tell it."""
        stored = record.get("coverage")
        # Versions before counted rejections only
        if not isinstance(stored, Mapping):
            counts = record.get("counts", {})
            pairs, rejected = counts.get("pairs", 0), counts.get("rejected_pair", 0)
            return cls(pairs + rejected, pairs, {OTHERS: rejected} if rejected else {})
        search = stored.get("search")
        return cls(**{**stored, "search": Search(**search) if search else None})


class CoverageTally:
    """
    Rejected rows by kind and area, counted while the rejections of chunks are read.

    Parameters
    ----------
    search : Search, optional
        The search that made the pair tables.
    """

    def __init__(self, search: Search | None = None) -> None:
        self.search = search
        self.kinds: Counter[str] = Counter()
        self.areas: Counter[str] = Counter()

    def add(
        self, rejections: Iterable[Rejection], areas: Mapping[str, int] = MappingProxyType({})
    ) -> None:
        """Count rejections by the kind of their reason, and those of each area."""
        self.areas.update(areas)
        for rejection in rejections:
            kind = kind_of(rejection.reasons)
            # Reasons of any text may not make any number of kinds
            is_new = kind not in self.kinds and len(self.kinds) >= 20 * MOST_KINDS
            self.kinds[OTHERS if is_new else kind] += 1

    def coverage(self, counts: Mapping[str, int]) -> Coverage:
        """Return the coverage of a screening with these counts of pairs and rejected pairs."""
        rows, areas = counts["pairs"] + counts["rejected_pair"], worst_areas(self.areas)
        return Coverage(rows, counts["pairs"], most_first(self.kinds), areas, self.search)


def most_first(kinds: Mapping[str, int]) -> dict[str, int]:
    """Return counts in falling order, the rare ones together."""
    counts = Counter(dict(kinds))
    others = counts.pop(OTHERS, 0)
    ordered = counts.most_common()
    others += sum(count for _, count in ordered[MOST_KINDS:])
    return dict(ordered[:MOST_KINDS]) | ({OTHERS: others} if others else {})


def worst_areas(areas: Mapping[str, int]) -> list[tuple[str, int]]:
    """Return the areas with most rows left out; none without a name."""
    return [(name, count) for name, count in Counter(areas).most_common() if name][:MOST_AREAS]


def search_account(
    pairs: int,
    rejected: Iterable[Rejection],
    areas: Iterable[str] = (),
    restricted: Sequence[str] = (),
) -> Search:
    """
    Return the account of a search.

    Parameters
    ----------
    pairs : int
        Pairs in its table.
    rejected : iterable of Rejection
        Of neighbours (``pair``) and of features of the layer (``building``).
    areas : iterable of str
        Area of each neighbour that is left out.
    restricted : sequence of str, optional
        Sources of the outlines whose licence forbids commercial use, with the licence.
    """
    kinds = {"pair": CoverageTally(), "building": CoverageTally()}
    for rejection in rejected:
        kinds[rejection.kind].add([rejection])
    pair, building = (most_first(tally.kinds) for tally in kinds.values())
    return Search(pairs, pair, building, worst_areas(Counter(areas)), restricted)


def as_metadata(search: Search) -> dict[bytes, bytes]:
    """Return an account as metadata of a Parquet file."""
    return {METADATA: json.dumps(asdict(search)).encode()}


def search_of_table(path: Path, rows: int) -> Search | None:
    """
    Return the account of the search that made a pair table, None if there is none.

    Parameters
    ----------
    path : Path
        The pair table; next to it ``*.rejected.csv`` is read where its metadata have no account.
    rows : int
        Rows of the table.
    """
    if path.suffix.lower() in (".parquet", ".pq"):
        import pyarrow.parquet as pq

        text = (pq.read_schema(path.absolute()).metadata or {}).get(METADATA)
        if search := _stored_search(text):
            return search
    beside = path.with_suffix(".rejected.csv")
    return _search_of_rejections(beside, rows) if beside.is_file() else None


def _stored_search(text: bytes | None) -> Search | None:
    """Return the account in metadata, None if there is none or it is damaged."""
    try:
        return Search(**json.loads(text)) if text else None
    except (ValueError, TypeError):
        return None


def _search_of_rejections(path: Path, rows: int) -> Search | None:
    """Return the account of the table of rejections that a search wrote; None of another file."""
    try:
        return search_account(rows, stored_rejections(path))
    except (KeyError, ValueError, csv.Error):
        return None


def stored_rejections(path: Path) -> Iterator[Rejection]:
    """
    Yield the rows of a table of rejections, one by one.

    Raises
    ------
    ValueError
        If the file is another table.
    """
    with path.open(encoding="utf-8", newline="") as file:
        lines = csv.reader(file)
        # Another table may have the name
        if tuple(next(lines, ())) != Rejection._fields:
            raise ValueError(f"{path}: not a table of rejections")
        for kind, name, source, row, reasons in lines:
            line = int(row) if row.isdecimal() else None
            yield Rejection(kind, name, source, line, tuple(reasons.split("; ")))
