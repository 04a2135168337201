"""
Damage one station of real records in 48 ways, run each, and print what is said of the station.

Run: ``python workflows/damaged_records.py FOLDER [STATION]`` with a folder of raw MiniSEED and
StationXML, and QuakeML if there is some; prints what docs/processing.md sums up. Every variant is a
whole run with the other stations unchanged; they are resumed. STATION is ``NET.STA``; without it,
the station with the largest samples. Found is what gets a flag, warning or rejection that names the
fault; another one is printed as "other reason". It takes a few minutes.
"""

import logging
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from obspy import Inventory, Stream, read
from scipy.integrate import cumulative_trapezoid

from per_obspy.config import Run
from per_obspy.records.folder import find_stations
from per_obspy.report.files import Report
from per_obspy.runs import stages
from per_obspy.runs.run import run

Samples = NDArray[np.float64]

#: Seed of noise and of the pairs.
SEED = 7

#: Words of which one must be in what is said of a fault.
AMPLITUDE = (
    *("implausible_amplitude", "peak ground", "peak acceleration", "peak velocity, m/s"),
    "beyond 1e+30",
)
LOST, LIMIT = ("filled", "dropout"), ("clipped",)
TIMES = ("sampling rate", "sampling interval", "this rate is wrong")
PLACE = ("coordinates", "implausible_place", "its place", "would be")


class Record(NamedTuple):
    """A station: traces as read, metadata, and the traces of another station."""

    stream: Stream
    inventory: Inventory
    other: Stream


class Fault(NamedTuple):
    """A fault: name, change of a record in place, and the words that name it."""

    name: str
    damage: Callable[[Record], object]
    words: tuple[str, ...]


# Changes of samples: they return a function of a record


def each(change: Callable[[Samples], Samples], letters: str = "") -> Callable[[Record], None]:
    """Return a fault that changes the samples of all components, or of some letters."""

    def damage(record: Record) -> None:
        for trace in record.stream:
            if not letters or trace.stats.channel[-1] in letters:
                trace.data = change(trace.data.astype(np.float64))

    return damage


def sensitivity(factor: float) -> Callable[[Record], None]:
    """Return a fault of the unit: the motion becomes so many times as large."""

    def damage(record: Record) -> None:
        for response in responses(record):
            response.instrument_sensitivity.value /= factor
            response.response_stages[0].stage_gain /= factor

    return damage


def responses(record: Record) -> list:
    """Return the responses of all channels."""
    channels = [channel for network in record.inventory for place in network for channel in place]
    return [channel.response for channel in channels if channel.response]


def units(name: str) -> Callable[[Record], None]:
    """Return a fault of StationXML: another input unit of sensitivity and first stage."""

    def damage(record: Record) -> None:
        for response in responses(record):
            response.instrument_sensitivity.input_units = name
            response.response_stages[0].input_units = name

    return damage


def interval(factor: float, letters: str = "") -> Callable[[Record], None]:
    """Return a fault of the sampling interval in the file."""

    def damage(record: Record) -> None:
        for trace in record.stream:
            if not letters or trace.stats.channel[-1] in letters:
                trace.stats.delta *= factor

    return damage


def place(change: Callable[[float, float], tuple[float, float]]) -> Callable[[Record], None]:
    """Return a fault of the coordinates in StationXML."""

    def damage(record: Record) -> None:
        for network in record.inventory:
            for station in network:
                for site in (station, *station):
                    site.latitude, site.longitude = change(site.latitude, site.longitude)

    return damage


def component(record: Record, letter: str):
    """Return the component of a letter."""
    return next(trace for trace in record.stream if trace.stats.channel.endswith(letter))


def copied_to(source: str, *targets: str) -> Callable[[Record], None]:
    """Return a fault: components have the samples of another one."""

    def damage(record: Record) -> None:
        for target in targets:
            component(record, target).data = component(record, source).data.copy()

    return damage


def exchanged(one: str, other: str) -> Callable[[Record], None]:
    """Return a fault: two components have each other's samples."""

    def damage(record: Record) -> None:
        first, second = component(record, one), component(record, other)
        first.data, second.data = second.data, first.data

    return damage


def late(seconds: float) -> Callable[[Record], None]:
    """Return a fault: the east component comes later, after more of its noise."""

    def damage(record: Record) -> None:
        trace = component(record, "E")
        count = round(seconds / trace.stats.delta)
        trace.data = np.concatenate((trace.data[:count], trace.data[:-count]))

    return damage


def gap(seconds: float, fill: str, letters: str = "") -> Callable[[Record], None]:
    """Return a fault: a gap at the peak of the strongest component, filled in one of three ways."""

    def damage(record: Record) -> None:
        strongest = max(record.stream, key=lambda trace: np.ptp(trace.data))
        middle = int(np.abs(strongest.data - np.median(strongest.data)).argmax())
        half = round(seconds / strongest.stats.delta / 2)
        first, last = middle - half, middle + half
        for trace in record.stream:
            if not letters or trace.stats.channel[-1] in letters:
                trace.data = filled(trace.data, first, last, fill)

    return damage


def filled(samples: Samples, first: int, last: int, fill: str) -> Samples:
    """Return samples with a gap that is filled."""
    out = samples.copy()
    ends = samples[first - 1], samples[last]
    line = np.linspace(*ends, last - first + 2)[1:-1]
    fills = {"zeros": 0, "last": ends[0], "line": np.round(line)}
    out[first:last] = fills[fill]
    return out


def strong_gap(share: float) -> Callable[[Record], None]:
    """Return a fault: zeros over a share of the time between 5 and 95 % of the energy."""

    def damage(record: Record) -> None:
        data = record.stream[0].data - np.median(record.stream[0].data)
        energy = np.cumsum(data.astype(np.float64) ** 2)
        first, last = np.searchsorted(energy, (0.05 * energy[-1], 0.95 * energy[-1]))
        dt = record.stream[0].stats.delta
        gap(share * (last - first) * dt, "zeros")(record)

    return damage


def limited(share: float, noise: float = 0.0) -> Callable[[Samples], Samples]:
    """Return a change: clipped at a share of the peak, with noise on top as a share of that."""

    def change(samples: Samples) -> Samples:
        motion = samples - np.median(samples)
        limit = share * np.abs(motion).max()
        random = np.random.default_rng(SEED).normal(size=motion.size)
        return np.clip(motion, -limit, limit) + noise * limit * random

    return change


def soft(samples: Samples) -> Samples:
    """Return samples whose sensor saturates softly at half of the peak."""
    motion = samples - np.median(samples)
    limit = 0.5 * np.abs(motion).max()
    return np.asarray(limit * np.tanh(motion / limit))


def wrapped(share: float) -> Callable[[Samples], Samples]:
    """Return a change: a counter that overflows at a share of the peak."""

    def change(samples: Samples) -> Samples:
        motion = samples - np.median(samples)
        limit = share * np.abs(motion).max()
        return np.asarray((motion + limit) % (2 * limit) - limit)

    return change


def scaled_to(peak: float) -> Callable[[Record], None]:
    """Return a fault: samples so large that their peak is some number of m/s2."""

    def damage(record: Record) -> None:
        gain = responses(record)[0].instrument_sensitivity.value
        each(lambda samples: samples / np.abs(samples).max() * peak * gain)(record)

    return damage


def as_velocity(record: Record) -> None:
    """Integrate the samples: velocity in m/s in place of acceleration."""
    for trace in record.stream:
        motion = trace.data - np.median(trace.data)
        trace.data = cumulative_trapezoid(motion, dx=trace.stats.delta, initial=0)


def spike(samples: Samples) -> Samples:
    """Return samples with one sample of three times the peak after the peak."""
    out, motion = samples.copy(), np.abs(samples - np.median(samples))
    out[int(motion.argmax()) + 300] += 3 * motion.max()
    return out


def step(record: Record) -> None:
    """Shift the baseline by 0.2 m/s2 at the peak."""
    gain = responses(record)[0].instrument_sensitivity.value
    for trace in record.stream:
        first = int(np.abs(trace.data - np.median(trace.data)).argmax())
        trace.data = trace.data + 0.2 * gain * (np.arange(trace.stats.npts) >= first)


def ending_at_peak(record: Record) -> None:
    """Cut the record a second after its peak."""
    for trace in record.stream:
        last = int(np.abs(trace.data - np.median(trace.data)).argmax())
        trace.data = trace.data[: last + round(1 / trace.stats.delta)]


def of_another_station(record: Record) -> None:
    """Replace the samples by those of another station."""
    for trace in record.stream:
        same = [one for one in record.other if one.stats.channel == trace.stats.channel]
        trace.data = same[0].data.copy()


def moved_in_time(seconds: float) -> Callable[[Record], None]:
    """Return a fault of the clock."""

    def damage(record: Record) -> None:
        for trace in record.stream:
            trace.stats.starttime += seconds

    return damage


FAULTS = (
    Fault("motion 9.81 times as large (unit)", sensitivity(9.81), AMPLITUDE),
    Fault("100 times as large", sensitivity(100), AMPLITUDE),
    Fault("981 times as large", sensitivity(981), AMPLITUDE),
    Fault("9.81 times as small", sensitivity(1 / 9.81), AMPLITUDE),
    Fault("100 times as small", sensitivity(1 / 100), AMPLITUDE),
    Fault("981 times as small", sensitivity(1 / 981), AMPLITUDE),
    Fault("peak of 1e18 m/s²", scaled_to(1e18), AMPLITUDE),
    Fault("peak of 1e300 m/s²", scaled_to(1e300), AMPLITUDE),
    Fault("M/S for M/S**2 in StationXML", units("M/S"), ("M/S",)),
    Fault(
        "velocity in place of acceleration",
        as_velocity,
        ("implausible_amplitude", "peak velocity over peak"),
    ),
    Fault("one component 9.81 times as large", each(lambda x: 9.81 * x, "E"), ("peak over",)),
    Fault("sampling interval twice", interval(2), TIMES),
    Fault("sampling interval half", interval(0.5), TIMES),
    Fault("sampling interval 10 times", interval(10), TIMES),
    Fault("sampling interval 1000 times (ms)", interval(1000), TIMES),
    Fault("sampling interval twice in one component", interval(2, "E"), TIMES),
    Fault("north is a copy of east", copied_to("E", "N"), ("samples are those",)),
    Fault("all components are copies", copied_to("E", "N", "Z"), ("samples are those",)),
    Fault("east 100 times as small", each(lambda x: x / 100, "E"), ("peak of",)),
    Fault("east 10 times as small", each(lambda x: x / 10, "E"), ("peak of",)),
    Fault("east 100 times as large", each(lambda x: x * 100, "E"), ("peak",)),
    Fault("east 2 s late", late(2.0), ("shifted in time",)),
    Fault("north and vertical exchanged", exchanged("N", "Z"), ("exchanged",)),
    Fault("north and east exchanged", exchanged("N", "E"), ("exchanged",)),
    Fault("east with the wrong sign", each(lambda x: -x, "E"), ("sign", "polarity")),
    Fault("0.2 s of zeros at the peak", gap(0.2, "zeros"), LOST),
    Fault("0.4 s of zeros", gap(0.4, "zeros"), LOST),
    Fault("1 s of zeros", gap(1.0, "zeros"), LOST),
    Fault("0.4 s of zeros in one component", gap(0.4, "zeros", "E"), LOST),
    Fault("zeros for 60 % of the strong motion", strong_gap(0.6), LOST),
    Fault("0.4 s of the last value", gap(0.4, "last"), LOST),
    Fault("0.4 s interpolated", gap(0.4, "line"), LOST),
    Fault("1 s interpolated", gap(1.0, "line"), LOST),
    Fault("clipped at 50 % of the peak", each(limited(0.5)), LIMIT),
    Fault("clipped at 80 %", each(limited(0.8)), LIMIT),
    Fault("clipped at 90 %", each(limited(0.9)), LIMIT),
    Fault("clipped at 50 %, then 1 % of noise", each(limited(0.5, 0.01)), LIMIT),
    Fault("clipped at 80 %, then 1 % of noise", each(limited(0.8, 0.01)), LIMIT),
    Fault("east clipped at 50 %", each(limited(0.5), "E"), LIMIT),
    Fault("saturated softly at 50 %", each(soft), LIMIT),
    Fault("counter overflows at 50 %", each(wrapped(0.5)), ("wrapped",)),
    Fault("counter overflows at 90 %", each(wrapped(0.9)), ("wrapped",)),
    Fault("a spike of 3 times the peak", each(spike), ("spike",)),
    Fault("baseline steps by 0.2 m/s²", step, ("spike or step", "baseline", "drifts", "final")),
    Fault("ends a second after the peak", ending_at_peak, ("ends while shaking",)),
    Fault(
        "samples of another station",
        of_another_station,
        ("its record is that of", "repeated_record"),
    ),
    Fault("station at 0, 0", place(lambda *_: (0.0, 0.0)), PLACE),
    Fault("longitude without its sign", place(lambda south, east: (south, -east)), PLACE),
)


def main(folder: Path, station: str | None) -> None:
    """Print the table."""
    found = find_stations(folder)
    streams = {name: read_all(files) for name, files in found.stations.items()}
    order = sorted(streams, key=lambda name: -max(np.ptp(trace.data) for trace in streams[name]))
    name, other = (station or order[0]), next(one for one in order if one != station)
    if name == other:
        other = order[1]
    network, code = name.split(".")
    inventory = found.inventory.select(network=network, station=code)
    with tempfile.TemporaryDirectory() as work:
        bench = Bench(Path(work), folder, name, found.stations[name])
        plain = bench.said(Record(streams[name], inventory, streams[other]))
        print(f"{name} of {len(streams)} stations; as it is: {plain or 'nothing'}\n")
        print("| fault | said | |\n|---|---|---|")
        count = 0
        for fault in FAULTS:
            record = Record(streams[name].copy(), inventory.copy(), streams[other])
            fault.damage(record)
            said = [one for one in bench.said(record) if one not in plain]
            is_named = any(word in one for one in said for word in fault.words)
            count += is_named
            verdict = "found" if is_named else ("other reason" if said else "not found")
            print(f"| {fault.name} | {shortened(said, fault.words)} | {verdict} |", flush=True)
    print(f"\n{count} of {len(FAULTS)} found")


def read_all(files: tuple[Path, ...]) -> Stream:
    """Return all traces of some files, whole numbers as they are."""
    return sum((read(path) for path in files), Stream())


def shortened(said: list[str], words: tuple[str, ...]) -> str:
    """Return the first thing that names the fault, else the first one."""
    named = [one for one in said if any(word in one for word in words)]
    return (named or said or ["nothing"])[0].replace("|", "/")


class Bench:
    """A folder with the records of a run, of which one station changes."""

    def __init__(self, work: Path, folder: Path, name: str, files: tuple[Path, ...]) -> None:
        self.work, self.name = work, name
        self.records = work / "records"
        self.records.mkdir()
        own = {path.resolve() for path in files}
        for path in folder.rglob("*"):
            if path.is_file() and path.resolve() not in own and path.name != f"{name}.xml":
                shutil.copy(path, self.records)

    def said(self, record: Record) -> list[str]:
        """Return rejections, flags and warnings of the station after a run."""
        for trace in record.stream:
            trace.write(str(self.records / f"{trace.id}.mseed"), format="MSEED")
        record.inventory.write(str(self.records / f"{self.name}.xml"), format="STATIONXML")
        # Metadata of a damaged station alone; the rest is resumed
        settings = Run.model_validate(
            {
                "name": "damaged",
                "output": str(self.work / "out"),
                "workers": 1,
                "records": {"folder": str(self.records)} | self.event(),
                "pairs": {"simulated": {"count": 5, "seed": SEED}},
                "screening": {"exact": False},
            }
        )
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            run(settings)
        return self.reasons()

    def event(self) -> dict[str, str]:
        """Return the QuakeML file of the folder, if it has one."""
        files = [
            path for path in self.records.glob("*.xml") if b"quakeml" in path.read_bytes()[:999]
        ]
        return {"event": str(files[0])} if files else {}

    def reasons(self) -> list[str]:
        """Return what the tables of a run say of the station."""
        stations = pd.read_csv(self.work / "out" / "stations.csv", dtype=str, keep_default_na=False)
        row = stations[stations["station"] == self.name]
        texts = [text for column in ("rejected", "warnings") for text in row.get(column, ())]
        said = [part for text in texts for part in text.split("; ") if part]
        flags = [flag for text in row.get("flags", ()) for flag in text.split()]
        # Files that could not be read have no station
        rejected = pd.read_csv(self.work / "out" / "rejected.csv", dtype=str, keep_default_na=False)
        own = rejected[rejected["name"].str.contains(self.name, regex=False)]
        said += [part for text in own["reasons"] for part in text.split("; ")]
        return [*dict.fromkeys(said), *flags]


if __name__ == "__main__":
    logging.disable()
    # Figures and page say no more of a station than its tables, and take most of the time
    stages.explained = stages.reported = lambda *_: Report([], [])
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else None)
