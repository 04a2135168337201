"""Samples: a station with a record, and pairs of buildings next to it."""

import numpy as np
import pandas as pd
from obspy import Stream, Trace
from obspy.core import AttribDict

import per_obspy
from per_obspy.config import Building
from per_obspy.inventory.checking import checked_pairs
from per_obspy.inventory.completion import completed_pairs
from per_obspy.screening.estimates import demand_columns
from per_obspy.screening.station_motion import motion_along_azimuths, station_motion
from per_obspy.screening.values import values


def make_station(
    name="ONE", scale=1.0, channels=("HNN", "HNE"), latitude=10.0, longest=9.0, seed=4
):
    """Return the Dataset of a station with a burst of noise, 40 s at 0.01 s."""
    # integrated noise: long periods prevail, as in strong motion
    noise = np.random.default_rng(seed).normal(size=(len(channels), 4000))
    motion = np.cumsum(noise * np.hanning(4000) * scale, axis=1)
    motion = (motion - motion.mean(axis=1, keepdims=True)) * np.hanning(4000)
    traces = [
        Trace(
            data,
            {
                "network": "XX",
                "station": name,
                "channel": channel,
                "delta": 0.01,
                "units": "m/s2",
                "coordinates": AttribDict(latitude=latitude, longitude=20.0, elevation=0.0),
                "per_obspy": AttribDict(shortest_period=0.05, longest_period=longest),
            },
        )
        for channel, data in zip(channels, motion, strict=True)
    ]
    periods, dampings = np.geomspace(0.05, 10.0, 60), (0.02, 0.05, 0.1)
    return per_obspy.station_spectra(Stream(traces), periods, dampings, 10)


def make_pairs(rows):
    """Return a checked pair table; every row holds the differences from two plain buildings."""
    plain = {
        "longitude_1": 20.0,
        "latitude_1": 10.0,
        "longitude_2": 20.0001,
        "latitude_2": 10.0,
        "height_1": 30.0,
        "height_2": 18.0,
        "storeys_1": 10.0,
        "storeys_2": 6.0,
        "period_1": 1.0,
        "period_2": 0.6,
        "gap": 0.05,
        "azimuth": 30.0,
    }
    table = pd.DataFrame([{"pair_id": f"P{i}", **plain, **row} for i, row in enumerate(rows)])
    return checked_pairs(table, "pairs.csv")


def table_of(station, rows):
    """Return pairs with radii and demands along their azimuths."""
    pairs = completed_pairs(make_pairs(rows), Building())
    record = station_motion(station)
    motion = motion_along_azimuths(record, pairs, values(pairs, "azimuth"))
    return pd.DataFrame(demand_columns(record, pairs, motion, "given", exact=True))
