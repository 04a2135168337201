"""Results of a run, a design spectrum or an ensemble, as every report reads them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import pandas as pd

from per_obspy.report.page.texts import Language
from per_obspy.report.tally import PairTally
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


class Event(NamedTuple):
    """
    Earthquake of a screening, as far as files and records know it.

    Attributes
    ----------
    start, time : str
        First sample of the first record, and origin time, UTC; empty if unknown.
    magnitude : float
        NaN if unknown.
    place : tuple of float or None
        Longitude and latitude of the hypocentre, degrees, and its depth, m.
    source : str
        Sentences on a spectrum or on scenarios in place of an earthquake; empty if there is one.
    revision : int
        Number of the revision of these results; 0 if they have none.
    revised, event_id : str
        Time of that revision, UTC, and identifier of the earthquake; empty if unknown.
    """

    start: str = ""
    time: str = ""
    magnitude: float = math.nan
    place: tuple[float, float, float] | None = None
    source: str = ""
    revision: int = 0
    revised: str = ""
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
    """

    stations: Mapping[str, dict[str, Any]] = {}
    histories: Mapping[int, dict[str, Any]] = {}
    sensitivity: Mapping[int, list[list[Any]]] = {}
    worst: int = 0
    doubtful: int = 0


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
    language : {'en', 'es'}
        Of page and summary.
    event : Event
        The earthquake.
    source : sequence of str
        Sentences on the earthquake, the spectrum or the scenarios.
    tally : PairTally
        Counts of all pairs.
    worst : DataFrame
        The worst pairs with all columns and their areas, at most ``PAGE_PAIRS``.
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
        ``coast`` and ``borders``, lines of longitude and latitude by turns.
    drawings : Drawings
        Histories, stations and sensitivities.
    provenance : sequence of (str, str)
        Titles and texts on where the results come from.
    own : sequence of str
        Columns of pairs that are computed, besides those of every risk table.
    """

    stem: str
    region: Region
    coverage: Coverage
    language: Language = "en"
    event: Event = field(default_factory=Event)
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
    lines: Mapping[str, list[list[float]]] = field(default_factory=dict)
    drawings: Drawings = field(default_factory=Drawings)
    provenance: Sequence[tuple[str, str]] = ()
    own: Sequence[str] = ()
