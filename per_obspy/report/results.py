"""Results of a run, a design spectrum or an ensemble, as every report reads them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import pandas as pd
import xarray as xr

from per_obspy.report.tally import PairTally
from per_obspy.report.texts import counted, texts_of, written
from per_obspy.results.coverage import Coverage


class Region(NamedTuple):
    """
    Title, classes and places of a screening.

    Attributes
    ----------
    title : str
        Name of the run.
    classes : sequence of str
        Names of the risk classes, worst first.
    simulated : bool
        Whether the ground motion is simulated.
    stations : DataFrame
        ``longitude, latitude`` of stations with usable records, degrees; may be empty.
    epicentre : tuple of float, or None
        Longitude and latitude, degrees.
    """

    title: str
    classes: Sequence[str]
    simulated: bool
    stations: pd.DataFrame
    epicentre: tuple[float, float] | None = None


class Revision(NamedTuple):
    """
    Revision of the results of a watched earthquake.

    Attributes
    ----------
    number : int
        0 if the run is none.
    time : str
        When the results were made, UTC; empty where unknown.
    event_id : str
        Identifier of the earthquake in its list; empty where unknown.
    """

    number: int = 0
    time: str = ""
    event_id: str = ""


class Drawings(NamedTuple):
    """
    Drawings and sensitivities of some pairs and stations.

    Attributes
    ----------
    stations : mapping of str to dict
        Name -> record and spectra of a station.
    histories : mapping of int to dict
        Rank -> displacement history of a pair.
    sensitivity : mapping of int to list
        Rank -> input, both values, and probability and state at each of them.
    worst, doubtful : int
        Pairs whose sensitivity is computed: the worst, and those with a chance nearest to a half.
    radii : mapping of str to list
        Name -> PER and SD of a station at one period, cm.
    """

    stations: Mapping[str, dict[str, Any]] = {}
    histories: Mapping[int, dict[str, Any]] = {}
    sensitivity: Mapping[int, list[list[Any]]] = {}
    worst: int = 0
    doubtful: int = 0
    radii: Mapping[str, list[float]] = {}


@dataclass(frozen=True)
class Results:
    """
    Results of one screening.

    Attributes
    ----------
    stem : str
        ``risk`` (of a run), ``design`` or ``ensemble``: name of its files and kind of its texts.
    region : Region
        Title, classes, stations and epicentre.
    coverage : Coverage
        Rows of the pair tables, and those that are left out.
    language : str
        Of page and summary.
    revision : Revision
        Number and time of the results.
    source : sequence of str
        Sentences on the earthquake, the spectrum or the scenarios.
    tally : PairTally
        Counts of all pairs.
    worst : DataFrame
        The worst pairs with the columns of the page and their areas, at most ``PAGE_PAIRS``.
    listed : DataFrame
        The worst pairs for summary, KML and workbook.
    shown : DataFrame
        Pairs of a map, evenly from all of them.
    areas : DataFrame
        Totals by area; may be empty.
    buildings : DataFrame
        The worst buildings; empty where there is no table of buildings.
    buildings_hit : int or None
        Number of all buildings that a neighbour can hit; None if the table does not know.
    stations : DataFrame
        Rows of ``stations.csv``; may be empty.
    rejected : DataFrame
        First rows of ``rejected.csv``.
    rejections : int
        Number of all its rows.
    outlines : sequence of (str, list of float)
        Buildings and their outlines: longitude and latitude by turns, degrees.
    lines : mapping of str to list
        ``coast`` and ``borders``, lines of longitude and latitude by turns; ``background``, lines
        of the user; ``towns``, names with longitude and latitude, the largest first.
    drawings : Drawings
        Histories, stations and sensitivities.
    record : Dataset or None
        Station file of the pair that is drawn from its record to pounding; None without a record.
    provenance : sequence of (str, str)
        Titles and texts on where the results come from.
    own : sequence of str
        Columns of pairs that are computed, besides those of every risk table.
    class_limits : mapping of str to float
        Smallest expected impact velocity of each class, m/s.
    """

    stem: str
    region: Region
    coverage: Coverage
    language: str = "en"
    revision: Revision = field(default_factory=Revision)
    source: Sequence[str] = ()
    tally: PairTally = field(default_factory=lambda: PairTally(()))
    worst: pd.DataFrame = field(default_factory=pd.DataFrame)
    listed: pd.DataFrame = field(default_factory=pd.DataFrame)
    shown: pd.DataFrame = field(default_factory=pd.DataFrame)
    areas: pd.DataFrame = field(default_factory=pd.DataFrame)
    buildings: pd.DataFrame = field(default_factory=pd.DataFrame)
    buildings_hit: int | None = None
    stations: pd.DataFrame = field(default_factory=pd.DataFrame)
    rejected: pd.DataFrame = field(default_factory=pd.DataFrame)
    rejections: int = 0
    outlines: Sequence[tuple[str, list[float]]] = ()
    lines: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    drawings: Drawings = field(default_factory=Drawings)
    record: xr.Dataset | None = None
    provenance: Sequence[tuple[str, str]] = ()
    own: Sequence[str] = ()
    class_limits: Mapping[str, float] = field(default_factory=dict)

    @property
    def texts(self) -> Mapping[str, str]:
        """Return the texts about results of this kind by their keys."""
        return texts_of(self.language, self.stem)

    def written(self, value: float, digits: int = 0) -> str:
        """Return a number as the language writes it."""
        return written(value, digits, self.language)

    def counted(self, key: str, count: float, **values: str) -> str:
        """Return a text about a number of things."""
        return counted(self.language, key, count, self.stem, **values)
