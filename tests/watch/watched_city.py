"""A small simulated city for a watcher, and a service on loopback with its earthquake."""

from collections.abc import Sequence
from concurrent.futures import Executor
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
from fdsn_server import FdsnServer
from obspy.core.event import Event, Magnitude, Origin

from per_obspy.config import Run, Scenario
from per_obspy.inventory.files.writing import write_pairs
from per_obspy.progress import Progress, silent
from per_obspy.records.fdsn.cache import Fetched, fetched_stations
from per_obspy.runs.output_folder import Result, file_hashes, recorded
from per_obspy.simulation.buildings import simulated_pairs
from per_obspy.simulation.earthquake import Simulation, simulate
from per_obspy.watch.event_settings import read_settings
from per_obspy.watch.state import EventState, read_event_states
from per_obspy.watch.watch import Clock, Pass, watch_once

ORIGIN = datetime(2000, 1, 1, tzinfo=UTC)

#: Runs of the tests, s after the origin time.
DELAYS = (60, 300, 900)

CONFIGURATION = """\
name = "city"
output = "out"
workers = 1
[records.fdsn]
providers = ["{url}"]
retries = 0
before = 20
after = 120
wait = 0.01
[pairs]
file = "pairs.csv"
[spectra]
count = 12
dampings = [0.05]
azimuth_step = 30
[watch]
service = "{url}"
delays = {delays}
latency = 10
poll = 30
{watch}
"""


class FakeClock:
    """A clock that does not move by itself; waiting moves it."""

    def __init__(self, seconds: float = 0.0) -> None:
        self.time = ORIGIN + timedelta(seconds=seconds)
        self.waits: list[float] = []

    def now(self) -> datetime:
        return self.time

    def at(self, seconds: float) -> Clock:
        """Return the clock, moved to so many seconds after the origin time."""
        self.time = ORIGIN + timedelta(seconds=seconds)
        return Clock(self.now, self.wait)

    def wait(self, seconds: float) -> bool:
        self.waits.append(seconds)
        self.time += timedelta(seconds=seconds)
        return False


def city_earthquake(stations: int = 3, magnitude: float = 6.5) -> Simulation:
    """Return the earthquake of the city, at the same moment always."""
    return simulate(Scenario(stations=stations, magnitude=magnitude, dt=0.02))


def write_city(
    folder: Path,
    server: FdsnServer,
    watch: str = "",
    delays: Sequence[float] = DELAYS,
    pairs: int = 30,
) -> Path:
    """Write the inventory and the configuration of the watcher, and return the configuration."""
    places = [(station.longitude, station.latitude) for station in server.inventory[0]]
    longitude, latitude = np.array(places).T
    near = {"radius": 2000.0, "touching": 0.5}
    inventory = simulated_pairs(longitude, latitude, count=pairs, seed=1, **near)
    write_pairs(inventory, folder / "pairs.csv")
    text = CONFIGURATION.format(url=server.url, watch=watch, delays=list(delays))
    (folder / "city.toml").write_text(text)
    return folder / "city.toml"


def settings_of(file: Path, **watch: object) -> Run:
    """Return the settings of a watcher, with other values in its section."""
    settings = read_settings(file)
    return settings.model_copy(update={"watch": settings.watch.model_copy(update=watch)})


def other_event(
    seconds: float = 0.0, magnitude: float | None = 6.5, longitude: float = 0.0
) -> Event:
    """Return another earthquake, so many seconds after that of the city."""
    time = (ORIGIN + timedelta(seconds=seconds)).replace(tzinfo=None)
    origin = Origin(time=time, latitude=0.0, longitude=longitude, depth=15_000.0)
    sizes = [] if magnitude is None else [Magnitude(mag=magnitude, magnitude_type="Mw")]
    return Event(origins=[origin], magnitudes=sizes)


class City:
    """A watched city in a folder."""

    def __init__(
        self, folder: Path, server: FdsnServer, clock: FakeClock, executor: Executor | None
    ) -> None:
        self.clock, self.folder, self.executor = clock, folder / "out", executor
        self.progress: Progress = silent
        self.settings = settings_of(write_city(folder, server))

    def at(self, seconds: float, **changes: object) -> Pass:
        """Return the outcome of one pass, so many seconds after the origin time."""
        section = self.settings.watch.model_copy(update=changes)
        settings = self.settings.model_copy(update={"watch": section})
        return watch_once(settings, self.clock.at(seconds), self.progress, self.executor)

    def state(self, name: str = "xx1") -> EventState:
        return read_event_states(self.folder)[0][name]

    def event(self, name: str = "xx1") -> Path:
        return self.folder / "events" / name

    def revisions(self, name: str = "xx1") -> list[str]:
        return sorted(path.name for path in self.event(name).glob("revisions/*"))

    def changes(self) -> list[tuple[str, ...]]:
        table = pd.read_csv(self.event() / "latest" / "changes.csv", dtype=str).fillna("")
        return list(table.itertuples(index=False, name=None))


def magnified(simulation: Simulation, magnitude: float) -> Event:
    """Return the earthquake with another magnitude."""
    event = simulation.event.copy()
    event.magnitudes[0].mag = magnitude
    return event


def quick_run(settings: Run, *others: object) -> Result:
    """Stand in for a whole run: tables that depend on event and records, as those of a run do."""
    folder, facts = settings.output, others[3]
    (folder / "stations").mkdir(parents=True, exist_ok=True)
    records = fetched_files(settings, others[4])
    magnitude = (settings.records.event or folder).read_text().partition("<mag>")[2][:60]
    # One pair per station, or of a map alone, of a state that follows from the earthquake
    state = "yes" if "7" in magnitude else "no"
    names = [path.stem for path in records]
    pairs = names or ["map"]
    risk = {"rank": range(1, len(pairs) + 1), "pair_id": pairs}
    risk |= {"state": [state] * len(pairs), "risk_class": ["low"] * len(pairs)}
    pd.DataFrame(risk).to_parquet(folder / "risk.parquet")
    stations = pd.DataFrame({"station": names, "state": ["used"] * len(names)})
    stations.to_csv(folder / "stations.csv", index=False)
    for name in ("configuration.toml", "report.html", "summary.txt"):
        (folder / name).write_text(f"# {facts}")
    files = ("risk.parquet", "stations.csv", "summary.txt", "report.html")
    made = [folder / name for name in files]
    counts = {"stations": len(names), "pairs": len(names), state: len(names)}
    record = {"state": "complete", "counts": counts, **facts}
    record |= {"key": "k", "outputs": file_hashes(folder, made)}
    return recorded(folder / "run.json", record)


def fetched_files(settings: Run, fetched: Fetched | None) -> list[Path]:
    """Return the records of the window of an earthquake, or those of its folder."""
    if fetched is None:
        return sorted(settings.records.folder.iterdir())
    return sorted(files[0] for files in fetched_stations(fetched).stations.values())
