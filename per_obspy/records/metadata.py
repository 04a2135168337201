"""
Metadata of a trace from StationXML, merged by epoch, and from tables of stations.

They are coordinates, orientation, response, and the ground under the station.
"""

from collections.abc import Callable, Iterator
from io import BytesIO
from itertools import pairwise
from typing import Any

import numpy as np
from obspy import Inventory, Trace, UTCDateTime
from obspy.core import AttribDict
from obspy.core.inventory import Channel, Response, Station

from per_obspy.checks import FloatArray
from per_obspy.errors import RecordRejected
from per_obspy.formats.knet import with_knet_words
from per_obspy.formats.text.vocabulary import horizontal
from per_obspy.names import code_problem
from per_obspy.processing.instrument_response import with_overall_sensitivity
from per_obspy.records.coordinate_sources import STATIONXML, Place, place_noted, table_of
from per_obspy.units import unit_of_si

_CODES = ("network", "station", "location", "channel")

_PLACE = ("latitude", "longitude", "elevation")

#: beginning of the comment by which simulated stations are known
SIMULATION_MARK = "SIMULATED by per_obspy"


def with_metadata(trace: Trace, inventory: Inventory | None) -> Trace:
    """
    Return a copy of a trace in the words of ``formats/text/vocabulary.py``.

    Parameters
    ----------
    trace : Trace
        Read from a file. Header words that a format plugin filled are kept; gaps are filled from
        StationXML.
    inventory : Inventory or None
        All the StationXML there is.

    Raises
    ------
    RecordRejected
        If a code holds other letters than those of codes, units or, for counts, the response are
        unknown, or StationXML contradicts itself.
    """
    if problem := code_problem(*(trace.stats[name] for name in _CODES)):
        raise RecordRejected(trace.id, problem)
    result = with_knet_words(trace) if "knet" in trace.stats else trace.copy()
    channel = _channel(result, inventory)
    if channel is not None:
        _describe(result, channel)
    elif "units" not in result.stats:
        problem = f"{_missing(trace, inventory)}, so the unit of its samples is unknown"
        raise RecordRejected(trace.id, problem)
    # Place and ground belong to the station, which may be known without the channel
    place_noted(result, _places(result, inventory, channel))
    result.stats.update(_ground(result, inventory))
    if _is_simulated(result, inventory):
        result.stats.simulated = True
    result.data = _samples(result)
    return result


def _samples(trace: Trace) -> FloatArray:
    """Return the samples in double precision; all must be finite."""
    samples = np.asarray(trace.data, dtype=np.float64)
    finite = np.isfinite(samples)
    if not finite.all():
        first = int(np.argmin(finite))
        raise RecordRejected(
            trace.id, f"{np.sum(~finite)} samples are not finite, the first is sample {first + 1}"
        )
    return samples


def _missing(trace: Trace, inventory: Inventory | None) -> str:
    """Return the reason why a trace has no channel."""
    if inventory is None:
        return "there is no StationXML"
    return f"StationXML has no channel {trace.id} at {trace.stats.starttime}"


def _channel(trace: Trace, inventory: Inventory | None) -> Channel | None:
    """Return the channel of a trace at its start, or None."""
    stats = trace.stats
    codes = (stats.channel, stats.location)
    channels = []
    for station in _stations(trace, inventory):
        for channel in station:
            is_same = (channel.code, channel.location_code) == codes
            if is_same and channel.is_active(stats.starttime):
                channels.append(channel)
    return _only(trace, "channel", channels, _channel_facts)


def _stations(trace: Trace, inventory: Inventory | None) -> Iterator[Station]:
    """Yield the descriptions of a trace's station that are valid at its start, tables too."""
    stats = trace.stats
    for network in inventory or ():
        if network.code != stats.network:
            continue
        for station in network:
            if station.code == stats.station and station.is_active(stats.starttime):
                yield station


def _only(
    trace: Trace,
    kind: str,
    descriptions: list[Any],
    facts: Callable[[Any], dict[str, Any]],
    source: str = "StationXML",
) -> Any:
    """Return the one description there is, or None; several must have the same facts."""
    for first, second in pairwise(descriptions):
        # Name every fact in which two descriptions differ
        repeated = facts(second)
        differing = [
            f"{name} {value} and {repeated[name]}"
            for name, value in facts(first).items()
            if repeated[name] != value
        ]
        if differing:
            where = f"{source} contradicts itself about the {kind} at {trace.stats.starttime}"
            raise RecordRejected(trace.id, f"{where}: {', '.join(differing)}")
    return descriptions[0] if descriptions else None


def _station_facts(station: Station) -> dict[str, Any]:
    return {name: getattr(station, name) for name in _PLACE}


def _channel_facts(channel: Channel) -> dict[str, Any]:
    facts = {name: getattr(channel, name) for name in (*_PLACE, "azimuth", "dip")}
    return facts | {"sensitivity": _sensitivity(channel)}


def _sensitivity(channel: Channel) -> float | None:
    """Return the overall sensitivity, counts per unit of the ground motion, or None."""
    if channel.response is None:
        return None
    sensitivity = with_overall_sensitivity(channel.response).instrument_sensitivity
    return sensitivity.value if sensitivity else None


def _describe(trace: Trace, channel: Channel) -> None:
    """Fill the gaps of a trace's words from its channel."""
    stats = trace.stats
    if "sensor_azimuth" not in stats and "sensor_dip" not in stats:
        stats.update(_direction(channel))
    if channel.sample_rate:
        stats.channel_rate = float(channel.sample_rate)
    # Counts need a response, unless the file has their gain and StationXML no sensitivity
    if stats.get("units", "counts") == "counts" and (stats.calib == 1 or _sensitivity(channel)):
        stats.response = _response(trace, channel)
        quantity = _quantity(trace, stats.response.instrument_sensitivity.input_units)
        stats.update({"units": "counts", "quantity": quantity, "processing_level": "raw"})


def _is_agency(table: str) -> tuple[bool, str]:
    """Return the sorting key of a table: those of users are CSV, then by name."""
    return not table.lower().endswith(".csv"), table


def _place(site: Channel | Station) -> AttribDict:
    """Return the coordinates of a channel or station, degrees and m, as far as they are known."""
    place = AttribDict(latitude=float(site.latitude), longitude=float(site.longitude))
    # Tables may have no elevation
    unknown = any(comment.value == "elevation=unknown" for comment in site.comments)
    return place if unknown else AttribDict({**place, "elevation": float(site.elevation)})


def _direction(channel: Channel) -> dict[str, float]:
    """Return azimuth and dip of a channel as far as they are known; the dip of a vertical alone."""
    dip = channel.dip
    # A vertical may be known by its code only
    vertical = -90.0 if dip is None and channel.code.endswith("Z") else dip
    if vertical is not None and abs(vertical) == 90:
        return {"sensor_dip": float(vertical)}
    if channel.azimuth is None:
        return {}
    known_dip = {} if dip is None else {"sensor_dip": float(dip)}
    return horizontal(float(channel.azimuth)) | known_dip


def _response(trace: Trace, channel: Channel) -> Response:
    """Return the response of a channel, which must have a sensitivity or gains."""
    if not _sensitivity(channel):
        raise RecordRejected(
            trace.id, f"StationXML gives no sensitivity at {trace.stats.starttime}"
        )
    return with_overall_sensitivity(channel.response)


def _quantity(trace: Trace, unit: str | None) -> str:
    """Return the quantity that an instrument measures, from the input unit of its response."""
    motion = unit_of_si(unit)
    if motion is None:
        raise RecordRejected(
            trace.id, f"the instrument measures {unit!r} by its StationXML, not ground motion"
        )
    return motion.quantity


def _places(trace: Trace, inventory: Inventory | None, channel: Channel | None) -> list[Place]:
    """
    Return the places that tables and StationXML give a trace, in the order of their preference.

    Unknown ones stay absent: spectra need none.
    """
    stations = list(_stations(trace, inventory))
    # Tables that people write go before those of agencies
    names = sorted({table_of(station) for station in stations} - {""}, key=_is_agency)
    places = []
    for name in names:
        rows = [station for station in stations if table_of(station) == name]
        row = _only(trace, "station", rows, _station_facts, f"the table {name}")
        places.append(Place(name, _place(row)))
    # Of StationXML the channel, which is nearer to the sensor
    described = [station for station in stations if not table_of(station)]
    site = channel or _only(trace, "station", described, _station_facts)
    return [*places, *([Place(STATIONXML, _place(site))] if site is not None else [])]


def _ground(trace: Trace, inventory: Inventory | None) -> dict[str, str | float]:
    """
    Return the ground under the station.

    It is in comments: ``site_class=`` any word, ``vs30=`` m/s.
    """
    words = _comment_words(trace, inventory)
    ground: dict[str, str | float] = {}
    if words.get("site_class"):
        ground["site_class"] = words["site_class"]
    # The velocity must be a decimal number above zero
    if "vs30" in words:
        vs30 = words["vs30"]
        if not vs30.replace(".", "", 1).isdecimal() or not float(vs30):
            raise RecordRejected(trace.id, f"vs30={vs30} in StationXML is not a velocity in m/s")
        ground["vs30"] = float(vs30)
    return ground


def _comment_words(trace: Trace, inventory: Inventory | None) -> dict[str, str]:
    """Return the ``name=value`` comments of a trace's station."""
    words = {}
    for station in _stations(trace, inventory):
        for comment in station.comments:
            name, _, value = (comment.value or "").partition("=")
            words[name.strip()] = value.strip()
    return words


def _is_simulated(trace: Trace, inventory: Inventory | None) -> bool:
    """Return whether the trace's station is one that this package simulated, by its comment."""
    for station in _stations(trace, inventory):
        if any((comment.value or "").startswith(SIMULATION_MARK) for comment in station.comments):
            return True
    return False


def metadata_text(inventory: Inventory) -> bytes:
    """Return the metadata as StationXML that is the same whenever and wherever it is written."""
    text = BytesIO()
    # The names of source and time of creation would differ
    undated = Inventory(networks=inventory.networks, source="", created=UTCDateTime(0))
    undated.write(text, format="STATIONXML")
    return text.getvalue()
