"""What StationXML knows about a trace, merged by epoch: coordinates, orientation, response, and the ground."""

from collections.abc import Iterator
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

#: input unit of a response -> what the samples measure
_QUANTITIES = {
    "M/S**2": "acceleration",
    "M/S/S": "acceleration",
    "M/(S**2)": "acceleration",
    "M/S": "velocity",
    "M": "displacement",
}


def with_metadata(trace: Trace, inventory: Inventory | None) -> Trace:
    """
    Return a copy of a trace in the words of ``formats/vocabulary.py``.

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
        If units or, for counts, the response are unknown, or StationXML contradicts itself.
    """
    result = with_knet_words(trace) if "knet" in trace.stats else trace.copy()
    channel = _channel(result, inventory)
    if channel is not None:
        _describe(result, channel)
    elif "units" not in result.stats:
        raise RecordRejected(
            trace.id, f"{_missing(trace, inventory)}, so what its samples measure is unknown"
        )
    if not result.stats.get("coordinates"):
        _place_station(result, inventory)
    result.stats.update(_ground(result, inventory))
    result.data = _samples(result)
    return result


def _samples(trace: Trace) -> FloatArray:
    samples = np.asarray(trace.data, dtype=np.float64)
    finite = np.isfinite(samples)
    if not finite.all():
        first = int(np.argmin(finite))
        raise RecordRejected(
            trace.id, f"{np.sum(~finite)} samples are not finite, the first is sample {first + 1}"
        )
    return samples


def _missing(trace: Trace, inventory: Inventory | None) -> str:
    if inventory is None:
        return "there is no StationXML"
    return f"StationXML has no channel {trace.id} at {trace.stats.starttime}"


def _channel(trace: Trace, inventory: Inventory | None) -> Channel | None:
    stats = trace.stats
    codes = (stats.channel, stats.location)
    found = [
        channel
        for station in _stations(trace, inventory)
        for channel in station
        if (channel.code, channel.location_code) == codes and channel.is_active(stats.starttime)
    ]
    return _only(trace, "channel", found, _channel_facts)


def _stations(trace: Trace, inventory: Inventory | None) -> Iterator[Station]:
    stats = trace.stats
    for network in inventory or ():
        if network.code == stats.network:
            yield from (
                station
                for station in network
                if station.code == stats.station and station.is_active(stats.starttime)
            )


def _only(trace: Trace, kind: str, found: list[Any], facts: Any) -> Any:
    """Return the one description there is, or None; several must say the same."""
    for one, other in pairwise(found):
        differing = [
            f"{name} {value} and {facts(other)[name]}"
            for name, value in facts(one).items()
            if facts(other)[name] != value
        ]
        if differing:
            where = f"StationXML contradicts itself about the {kind} at {trace.stats.starttime}"
            raise RecordRejected(trace.id, f"{where}: {', '.join(differing)}")
    return found[0] if found else None


def _station_facts(station: Station) -> dict[str, Any]:
    return {name: getattr(station, name) for name in ("latitude", "longitude", "elevation")}


def _channel_facts(channel: Channel) -> dict[str, Any]:
    facts = {
        name: getattr(channel, name)
        for name in ("latitude", "longitude", "elevation", "azimuth", "dip")
    }
    return facts | {"sensitivity": _sensitivity(channel)}


def _sensitivity(channel: Channel) -> float | None:
    sensitivity = channel.response.instrument_sensitivity if channel.response else None
    return sensitivity.value if sensitivity else None


def _describe(trace: Trace, channel: Channel) -> None:
    stats = trace.stats
    if not stats.get("coordinates"):
        stats.coordinates = _place(channel)
    if "sensor_azimuth" not in stats and "sensor_dip" not in stats:
        stats.update(_direction(channel))
    if stats.get("units", "counts") == "counts" and (stats.calib == 1 or _sensitivity(channel)):
        stats.response = _response(trace, channel)
        unit = stats.response.instrument_sensitivity.input_units
        stats.update(
            {"units": "counts", "quantity": _quantity(trace, unit), "processing_level": "raw"}
        )


def _place(site: Channel | Station) -> AttribDict:
    return AttribDict(
        latitude=float(site.latitude),
        longitude=float(site.longitude),
        elevation=float(site.elevation),
    )


def _direction(channel: Channel) -> dict[str, float]:
    vertical = -90.0 if channel.dip is None and channel.code.endswith("Z") else channel.dip
    if vertical is not None and abs(vertical) == 90:
        return {"sensor_dip": float(vertical)}
    if channel.azimuth is None:
        return {}
    dip = {} if channel.dip is None else {"sensor_dip": float(channel.dip)}
    return horizontal(float(channel.azimuth)) | dip


def _response(trace: Trace, channel: Channel) -> Response:
    if not _sensitivity(channel):
        raise RecordRejected(
            trace.id, f"StationXML gives no sensitivity at {trace.stats.starttime}"
        )
    return channel.response


def _quantity(trace: Trace, unit: str | None) -> str:
    if str(unit).upper() not in _QUANTITIES:
        raise RecordRejected(
            trace.id, f"StationXML says that the instrument measures {unit!r}, not ground motion"
        )
    return _QUANTITIES[str(unit).upper()]


def _place_station(trace: Trace, inventory: Inventory | None) -> None:
    """Fill the coordinates from StationXML; where nobody knows them they stay absent: spectra need none."""
    trace.stats.pop("coordinates", None)
    station = _only(trace, "station", list(_stations(trace, inventory)), _station_facts)
    if station is not None:
        trace.stats.coordinates = _place(station)


def _ground(trace: Trace, inventory: Inventory | None) -> dict[str, str | float]:
    """Return what comments of the station say of its ground: ``site_class=`` any word, ``vs30=`` m/s."""
    comments = (
        comment.value or ""
        for station in _stations(trace, inventory)
        for comment in station.comments
    )
    said = {
        name.strip(): value.strip() for name, _, value in (text.partition("=") for text in comments)
    }
    ground: dict[str, str | float] = (
        {"site_class": said["site_class"]} if said.get("site_class") else {}
    )
    if "vs30" not in said:
        return ground
    if not said["vs30"].replace(".", "", 1).isdecimal() or not float(said["vs30"]):
        raise RecordRejected(
            trace.id, f"StationXML says vs30={said['vs30']}, which is no velocity in m/s"
        )
    return ground | {"vs30": float(said["vs30"])}


def metadata_text(inventory: Inventory) -> bytes:
    """Return the metadata as StationXML that is the same whenever and wherever it is written."""
    text = BytesIO()
    Inventory(networks=inventory.networks, source="", created=UTCDateTime(0)).write(
        text, format="STATIONXML"
    )
    return text.getvalue()
