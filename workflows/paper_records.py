"""Locate the records of the paper's figures and tables; none belongs to the project."""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import obspy

from per_obspy import process
from per_obspy.checks import FloatArray
from per_obspy.config import Simulation, load
from per_obspy.records.text_table import read_columns
from per_obspy.simulation.earthquake import simulate

CHECKOUT = Path(__file__).resolve().parents[1]

#: Free-field horizontals processed by their agencies, high-pass at most 0.1 Hz where headers tell,
#: PGA above 0.05 g
BROAD_BAND = (
    "records/peer_at2/RSN15_KERN_TAF021.AT2",
    "records/peer_at2/RSN6_IMPVALL.I_I-ELC180.AT2",
    "records/peer_at2/RSN1044_DirRot2.AT2",
    "records/itaca2009/16833/16833_H1.cor.acc",
    "records/itaca2009/16833/16833_H2.cor.acc",
    "records/itaca2009/16839/16839_H1.cor.acc",
    "records/itaca2009/16839/16839_H2.cor.acc",
    "records/afad2023/20230206011732_3125_ap_AAD_Acc_E.asc",
    "records/afad2023/20230206011732_3125_ap_AAD_Acc_N.asc",
    "records/afad2023/20230206011732_4414_ap_AAD_Acc_E.asc",
    "records/afad2023/20230206011732_4414_ap_AAD_Acc_N.asc",
    "records/csmip_v2_only/ce36456p_CE36456.V2",
    "records/smc/0111a.smc",
    "spectra_v3/ci15481673_lahabra2014/CIWLT.V2",
)


class Record(NamedTuple):
    """One horizontal component: name, acceleration (m/s²), sampling interval (s), simulated."""

    name: str
    acceleration: FloatArray
    dt: float
    simulated: bool


def data_folder() -> Path:
    """Return the folder of real records, if any: PER_OBSPY_DATA or ``shared/data``."""
    return Path(os.environ.get("PER_OBSPY_DATA", CHECKOUT.parent / "shared" / "data"))


def mexico_city_1985() -> list[Record]:
    """Return the north and east components at SCT, 19 September 1985; the paper used the second."""
    path = data_folder() / "records" / "mexico1985_sct" / "sct190985.txt"
    place = {"network": "MX", "station": "SCT", "latitude": 19.393, "longitude": -99.147}
    stream = read_columns(path, **place, units="g", time_column=0, channels={"HNN": 1, "HNE": 2})
    return [
        _record(trace, f"SCT 1985 {direction}")
        for trace, direction in zip(stream, ("NS", "EW"), strict=True)
    ]


def broad_band(files: tuple[str, ...] = BROAD_BAND) -> list[Record]:
    """Return the horizontal components of files in the folder of real records."""
    streams = [(obspy.read(data_folder() / file), Path(file).stem) for file in files]
    return [
        _record(trace, f"{stem} {trace.stats.channel}")
        for stream, stem in streams
        for trace in stream
        if not trace.stats.channel.endswith("Z")
    ]


def simulated_lakebed() -> Record:
    """Return a processed horizontal of the demonstration's lakebed, a substitute for SCT 1985."""
    scenario = load(CHECKOUT / "catalogs" / "demo" / "scenario.toml", Simulation).scenario
    stream = simulate(
        scenario.model_copy(update={"stations": 2})
    ).stream  # the second stands on the lakebed
    trace = process(stream.select(station="S002")).select(component="N")[0]
    return _record(trace, "simulated lakebed", simulated=True)


def _record(trace: obspy.Trace, name: str, simulated: bool = False) -> Record:
    return Record(
        name, np.ascontiguousarray(trace.data, dtype=np.float64), trace.stats.delta, simulated
    )
