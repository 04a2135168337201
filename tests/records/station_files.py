"""Made-up files of the station CI.CLC: three channels of records and their StationXML."""

from pathlib import Path

import numpy as np
from obspy import Trace, UTCDateTime
from obspy.core.inventory import Channel, Inventory, Network, Response, Station
from obspy.core.inventory.response import InstrumentSensitivity

from per_obspy.records.folder import find_stations, read_station

START = UTCDateTime(2020, 1, 2, 3, 4, 5)

#: channel -> azimuth and dip, degrees
THREE = {"HN1": (30.0, 0.0), "HN2": (120.0, 0.0), "HNZ": (0.0, -90.0)}


def response(unit: str = "M/S**2", value: float = 2e5) -> Response:
    return Response(instrument_sensitivity=InstrumentSensitivity(value, 1.0, unit, "COUNTS"))


def inventory(
    channels: dict[str, tuple[float, float]],
    latitude: float = 35.0,
    answer: Response | None = None,
    **epoch: UTCDateTime,
) -> Inventory:
    # One epoch of one station in the desert
    place = {"latitude": latitude, "longitude": -117.0, "elevation": 700.0}
    descriptions = []
    for code, (azimuth, dip) in channels.items():
        facts = {**place, **epoch, "depth": 0, "azimuth": azimuth, "dip": dip}
        descriptions.append(Channel(code, "", **facts, response=answer or response()))
    station = Station("CLC", **place, channels=descriptions)
    return Inventory([Network("CI", [station])], source="test")


def write_inventory(metadata: Inventory, folder: Path, name: str = "station.xml") -> None:
    metadata.write(str(folder / name), format="STATIONXML")


def record(channel: str, samples: np.ndarray | None = None, station: str = "CLC") -> Trace:
    header = {
        "network": "CI",
        "station": station,
        "channel": channel,
        "starttime": START,
        "delta": 0.01,
    }
    return Trace(np.arange(300, dtype=np.int32) if samples is None else samples, header)


def write_records(folder: Path) -> None:
    """Write three records into a subfolder, and their StationXML into the folder."""
    below = folder / "deep" / "er"
    below.mkdir(parents=True)
    for code in THREE:
        record(code).write(str(below / f"{code}.mseed"), format="MSEED")
    write_inventory(inventory(THREE), folder)


def read_all(folder: Path, stationxml: Path | None = None) -> tuple[list[Trace], tuple[str, ...]]:
    """Return the traces of the station, and the reasons of its rejections."""
    contents = find_stations(folder, stationxml)
    stream, rejected = read_station(contents.stations["CI.CLC"], contents.inventory)
    return list(stream), tuple(reason for rejection in rejected for reason in rejection.reasons)
