"""
Every default of a run, with its unit and where it comes from; read from TOML.

Only ``run.py`` and ``cli.py`` see a configuration as a whole. Rooms below take plain arguments. Paths in a
configuration are relative to the folder of its file.
"""

import os
import tomllib
from datetime import datetime
from pathlib import Path
from typing import Annotated, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainSerializer,
    SerializationInfo,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails

from per_obspy.errors import CatalogError


def _from_folder(path: Path, info: ValidationInfo) -> Path:
    """Return a path of a configuration seen from the folder of its file."""
    return Path(os.path.normpath(info.context["folder"] / path)) if info.context else path


def _to_folder(path: Path, info: SerializationInfo) -> str:
    """Return the path as a configuration in that folder would write it."""
    return os.path.relpath(path, info.context["folder"]) if info.context else str(path)


def _moment(text: str) -> str:
    """Return a time as it was given, if it is one."""
    datetime.fromisoformat(text)
    return text


Moment = Annotated[str, AfterValidator(_moment)]
RelativePath = Annotated[Path, AfterValidator(_from_folder), PlainSerializer(_to_folder)]


class Section(BaseModel):
    """A frozen group of settings; an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Columns(Section):
    """How to read a plain table of samples (``records/columns.py``)."""

    file: RelativePath = Field(description="text file, one row a sample")
    network: str = Field("", description="SEED network code")
    station: str = Field(description="SEED station code")
    latitude: float = Field(ge=-90, le=90, description="degrees north")
    longitude: float = Field(ge=-180, le=180, description="degrees east")
    units: str = Field(description="of the samples: m/s2, cm/s2, gal, g")
    channels: dict[str, int] = Field(description="channel code -> column, counted from 0")
    azimuths: dict[str, float] = Field(default_factory=dict, description="channel code -> degrees from north")
    separator: str | None = Field(None, description="between columns; white space if not given")
    skip: int = Field(0, ge=0, description="header lines")
    time_column: int | None = Field(None, ge=0, description="column of time in s, checked for even spacing")
    dt: float | None = Field(None, gt=0, description="sampling interval in s, where there is no time column")
    start: str | None = Field(None, description="time of the first sample, ISO 8601, UTC")
    raw: bool = Field(False, description="not corrected yet")


class Window(Section):
    """A time window; what is not given is seen from the origin time of the event."""

    start: Moment | None = Field(None, description="ISO 8601, UTC; not given: before the origin time")
    end: Moment | None = Field(None, description="ISO 8601, UTC; not given: after the origin time")
    before: float = Field(30.0, ge=0, description="s from the start of the window to the origin time")
    after: float = Field(300.0, gt=0, description="s from the origin time to the end of the window")


class Fdsn(Window):
    """Records from FDSN web services around an epicentre; what was fetched stays in the cache."""

    providers: tuple[str, ...] = Field(
        min_length=1, description="in order of preference: ObsPy's names, base URLs, eida-routing, earthscope-federator"
    )
    cache: RelativePath = Field(description="folder that keeps what was fetched")
    event_id: str | None = Field(None, description="of the event service, instead of records.event")
    event_provider: str = Field("USGS", description="ObsPy's name or base URL of the event service")
    latitude: float | None = Field(None, ge=-90, le=90, description="centre, degrees north; not given: epicentre")
    longitude: float | None = Field(None, ge=-180, le=180, description="centre, degrees east; not given: epicentre")
    radius: float = Field(100_000.0, gt=0, le=20_000_000, description="m, of the circle in which stations are wanted")
    networks: tuple[str, ...] = Field(("*",), min_length=1, description="SEED codes, * and ? allowed")
    stations: tuple[str, ...] = Field(("*",), min_length=1, description="SEED codes, * and ? allowed")
    locations: tuple[str, ...] = Field(("*",), min_length=1, description="SEED codes, * and ? allowed; empty: --")
    channels: tuple[str, ...] = Field(
        ("HN?", "BN?", "CN?", "EN?"), min_length=1, description="SEED codes, * and ? allowed; accelerometers"
    )
    timeout: float = Field(60.0, gt=0, description="s without an answer, or without more of it")
    retries: int = Field(5, ge=0, description="after a fault that may pass (429, 5xx, time-out, cut answer)")
    wait: float = Field(1.0, ge=0, description="s; the second retry waits twice as long, and so on; Retry-After counts")
    connections: int = Field(3, ge=1, le=16, description="stations asked for at the same time")

    @property
    def knows_where_and_when(self) -> bool:
        """Whether centre and window are given, so that no event is needed."""
        return None not in (self.latitude, self.longitude, self.start, self.end)


class Sds(Window):
    """A time window of an SDS archive."""

    folder: RelativePath = Field(description="with YEAR/NET/STA/CHAN.D/ below it")


class Asdf(Section):
    """A workspace of gmprocess, or another ASDF file."""

    file: RelativePath = Field(description="HDF5 file")
    tag: str = Field("*_unprocessed", description="of the waveforms, * and ? allowed; *_default is gmprocess's result")


class Records(Section):
    """Where the records are; several sources may be given."""

    folder: RelativePath | None = Field(None, description="folder of waveform files, with StationXML beside them")
    stationxml: RelativePath | None = Field(None, description="StationXML file or folder, if not beside the records")
    event: RelativePath | None = Field(None, description="QuakeML file; no event is fine")
    columns: tuple[Columns, ...] = Field((), description="plain tables of samples")
    fdsn: Fdsn | None = Field(None, description="FDSN web services")
    sds: Sds | None = Field(None, description="SDS archive")
    asdf: Asdf | None = Field(None, description="ASDF workspace of gmprocess")

    @model_validator(mode="after")
    def _known_window(self) -> Self:
        if self.fdsn and not (self.fdsn.knows_where_and_when or self.fdsn.event_id or self.event):
            raise ValueError("fdsn needs event_id, or event, or latitude, longitude, start and end")
        if self.sds and not (self.event or (self.sds.start and self.sds.end)):
            raise ValueError("sds needs start and end, or event")
        return self


class Check(Section):
    """One check of a record: where it fails, and what a failure means."""

    threshold: float = Field(description="in the unit that the check names")
    level: str = Field(pattern="^(reject|warn|note)$", description="reject leaves the trace out; warn, note: recorded")


class Checks(Section):
    """Thresholds of ``processing/quality.py``, ``processing/outcome.py`` and ``processing/corners.py``."""

    sampling_rate: Check = Check(threshold=20.0, level="reject")  # Hz, at least
    duration: Check = Check(threshold=5.0, level="reject")  # s, at least
    levels: Check = Check(threshold=16, level="reject")  # different values a sample takes, at least
    clipped_run: Check = Check(threshold=5, level="reject")  # equal samples at an extreme, fewer than
    counter_use: Check = Check(threshold=0.8, level="warn")  # peak over full scale of a 24-bit counter, at most
    dropout: Check = Check(threshold=0.5, level="reject")  # s without change during the shaking, less than
    spike: Check = Check(threshold=6.0, level="reject")  # jump of one sample over others within 0.5 s, at most
    zero_crossings: Check = Check(threshold=0.1, level="reject")  # a second, at least
    header_peak: Check = Check(threshold=0.01, level="warn")  # relative, between header and samples, at most
    outlier: Check = Check(threshold=5.0, level="reject")  # peak over the largest peak of two sisters, at most
    late_trigger: Check = Check(threshold=0.1, level="warn")  # motion of the first second over the peak, at most
    cut_off: Check = Check(threshold=0.1, level="warn")  # motion of the last second over the peak, at most
    second_event: Check = Check(threshold=0.3, level="warn")  # later peak after quiet over the peak, at most
    signal_to_noise: Check = Check(threshold=2.0, level="reject")  # somewhere at least
    clear_band: Check = Check(threshold=2.0, level="warn")  # signal to noise over ``required_band``, at least
    bandwidth: Check = Check(threshold=4.0, level="reject")  # low-pass over high-pass corner, at least
    final_velocity: Check = Check(threshold=0.1, level="reject")  # over its peak, at most
    final_displacement: Check = Check(threshold=0.2, level="reject")  # over its peak, at most
    baseline_shift: Check = Check(threshold=0.5, level="warn")  # velocity before the filter that stays, over the peak


class Processing(Section):
    """The chain from raw record to one that spectra may be computed from (Boore 2005; gmprocess 2.8)."""

    highpass: float | None = Field(None, gt=0, description="corner, Hz; not given: found for each record")
    lowpass: float | None = Field(None, gt=0, description="corner, Hz; not given: found; never above 0.75 of Nyquist")
    order: int = Field(5, ge=1, le=20, description="n of the Butterworth amplitude 1/sqrt(1+(f_hp/f)^2n)")
    taper: float = Field(0.05, ge=0, le=0.5, description="fraction of the record at each end, Hann")
    usable: float = Field(0.8, gt=0, le=1, description="longest usable period = usable / f_hp")
    pre_event: float | None = Field(None, ge=0, description="s of noise at the start; not given: until the first wave")
    gain_tolerance: float = Field(0.1, gt=0, description="between product of stage gains and sensitivity, relative")
    overlap: float = Field(0.8, gt=0, le=1, description="part of the longer horizontal that both must cover")
    onset_margin: float = Field(0.5, ge=0, description="s before the first wave where the noise ends")
    shortest_noise: float = Field(2.0, gt=0, description="s of noise that tell something; fewer count as none")
    longest_noise: float = Field(120.0, gt=0, description="s before the first wave that are kept")
    longest_signal: float = Field(600.0, gt=0, description="s after the first wave that are kept")
    pick_tolerance: float = Field(10.0, gt=0, description="s between a pick and the computed travel time of P")
    smoothing: float = Field(20.0, gt=0, description="b of the Konno-Ohmachi window")
    required_band: tuple[float, float] = Field((0.2, 10.0), description="Hz, where the signal should clear the noise")
    highest_lowpass: float = Field(40.0, gt=0, description="Hz, where the noise does not ask for less")
    highpass_range: tuple[float, float] = Field((0.001, 0.5), description="Hz; never below 1 / duration")
    drift: float = Field(0.02, gt=0, lt=1, description="polynomial part of the displacement that counts as clean")
    fallback_highpass: dict[float, float] = Field(
        {-10.0: 0.5, 3.5: 0.3, 5.5: 0.1},
        description="without noise to measure: magnitude from which on -> corner, Hz (gmprocess 2.8)",
    )
    unknown_highpass: float = Field(0.08, gt=0, description="Hz, without noise to measure and without magnitude")
    permanent_offset: bool = Field(False, description="near a fault: keep it, no high-pass, adaptive baseline")
    checks: Checks = Checks()

    @model_validator(mode="after")
    def _one_long_period_limit(self) -> Self:
        if self.permanent_offset and self.highpass is not None:
            raise ValueError(f"permanent_offset keeps what highpass = {self.highpass:g} Hz removes: give one of them")
        return self


class Spectra(Section):
    """The grid of the stored spectra; pairs are computed at their own periods, not read off it."""

    dampings: tuple[float, ...] = Field((0.02, 0.05, 0.10, 0.20), description="fractions of critical")
    shortest: float = Field(0.05, gt=0, description="s")
    longest: float = Field(10.0, gt=0, description="s")
    count: int = Field(100, ge=2, description="periods, logarithmically spaced")
    azimuth_step: int = Field(10, ge=1, le=90, description="degrees between stored azimuths; RotD uses every degree")


class Building(Section):
    """What is assumed of a building where the inventory is silent; each use is marked as derived."""

    damping: float = Field(0.05, ge=0, lt=1, description="fraction of critical")
    damping_log_std: float = Field(0.3, ge=0, description="log-standard deviation of an assumed damping")
    storey_height: float = Field(3.0, gt=0, description="m")
    mass_per_area: float = Field(1000.0, gt=0, description="kg/m2 and floor")
    area: float = Field(200.0, gt=0, description="floor area, m2; only the ratio of the masses matters")
    restitution: float = Field(0.65, ge=0, le=1, description="of impact between concrete buildings")
    floor_tolerance: float = Field(0.61, ge=0, description="m; floors further apart than 2 ft misalign (FEMA P-154)")
    period_formula: str = Field("asce7", pattern="^(asce7|ec8)$", description="asce7 or ec8; medians, not lower bounds")


class Scenario(Section):
    """A simulated earthquake and the stations that record it (stochastic method, Boore 2003)."""

    seed: int = Field(20, ge=0, description="of every random number; the same seed gives the same samples")
    name: str = Field("Simulated earthquake", description="of the event")
    magnitude: float = Field(7.0, ge=4, le=8.5, description="moment magnitude")
    origin_time: str = Field("2000-01-01T00:00:00", description="ISO 8601, UTC")
    latitude: float = Field(0.0, ge=-90, le=90, description="of the epicentre, degrees north")
    longitude: float = Field(0.0, ge=-180, le=180, description="of the epicentre, degrees east")
    depth: float = Field(15_000.0, ge=0, le=700_000, description="m")
    stress_drop: float = Field(10e6, gt=0, description="Pa; 100 bar (Boore 2003)")
    density: float = Field(2800.0, gt=0, description="kg/m3 at the source (Boore 2003)")
    shear_velocity: float = Field(3500.0, gt=0, description="m/s at the source (Boore 2003)")
    quality: float = Field(180.0, gt=0, description="Q at 1 Hz (Raoof and others 1999)")
    quality_exponent: float = Field(0.45, ge=0, le=1, description="of frequency in Q (Raoof and others 1999)")
    kappa: float = Field(0.035, ge=0, description="s; generic rock (Boore & Joyner 1997)")
    stations: int = Field(24, ge=1, le=999, description="number of stations")
    city_latitude: float = Field(0.0, ge=-90, le=90, description="centre of the stations, degrees north")
    city_longitude: float = Field(0.3, ge=-180, le=180, description="centre of the stations, degrees east")
    city_radius: float = Field(12_000.0, gt=0, description="m")
    lakebed_latitude: float = Field(0.0, ge=-90, le=90, description="centre of the lakebed, degrees north")
    lakebed_longitude: float = Field(0.3, ge=-180, le=180, description="centre of the lakebed, degrees east")
    lakebed_radius: float = Field(6_000.0, ge=0, description="m; 0: no lakebed")
    lakebed_frequency: float = Field(0.5, gt=0, description="Hz, of the Kanai-Tajimi filter; Mexico City 0.4-0.6")
    lakebed_damping: float = Field(0.1, gt=0, lt=1, description="of the Kanai-Tajimi filter, fraction of critical")
    lakebed_scatter: float = Field(0.1, ge=0, description="log-standard deviation of its frequency between stations")
    correlation: float = Field(0.3, ge=-1, le=1, description="between the north and east components")
    vertical: float = Field(2 / 3, ge=0, description="vertical / horizontal spectrum on rock")
    noise: float = Field(2e-5, ge=0, description="m/s2, root mean square of the background")
    pre_event: float = Field(20.0, ge=0, description="s of background before the P wave")
    dt: float = Field(0.01, gt=0, le=0.05, description="sampling interval, s")

    @field_validator("origin_time")
    @classmethod
    def _a_time(cls, origin_time: str) -> str:
        datetime.fromisoformat(origin_time)
        return origin_time


class SimulatedPairs(Section):
    """A simulated inventory around the stations of a run."""

    count: int = Field(2000, ge=1, description="pairs")
    seed: int = Field(20, ge=0, description="of every random number")
    radius: float = Field(2000.0, gt=0, description="m, largest distance of a pair from its station")
    touching: float = Field(0.5, ge=0, le=1, description="share of pairs without a gap")


class Interpolation(Section):
    """How the motion between stations is estimated (``screening/interpolation.py``)."""

    log_std: float = Field(0.6, gt=0, description="of ln PER within an event, before any station tells; SA: 0.5 to 0.7")
    log_std_weight: float = Field(5.0, gt=0, description="number of stations that this value counts as")
    vs30_clustered: bool = Field(False, description="Vs30 varies smoothly over the region (Jayaram & Baker, case 2)")


class Codes(Section):
    """What code rules ask of a region (``screening/codes.py``); a rule stays empty where its value is not given."""

    ntc_zone: str | None = Field(None, pattern="^(I|II|III)$", description="NTC Mexico City 2004: I, II or III")
    gb_intensity: int | None = Field(None, ge=6, le=9, description="GB 50011-2010: fortification intensity")
    fema_seismicity: str | None = Field(
        None, pattern="^(very_high|high|moderately_high|lower)$", description="FEMA P-154: of the region"
    )
    floor_tolerance: float = Field(0.61, ge=0, description="m; floors no further apart than 2 ft align (FEMA P-154)")


class Screening(Section):
    """How pairs find their ground motion and how risk is named."""

    largest_distance: float = Field(20_000.0, gt=0, description="m from station to pair; pairs beyond are rejected")
    flag_distance: float = Field(5_000.0, gt=0, description="m, flagged beyond")
    model_dispersion: float = Field(0.35, ge=0, description="log-standard deviation of critical gap by PER / exact")
    possible_from: float = Field(0.1, ge=0, le=1, description="probability from which pounding counts as possible")
    per_to_sd: float = Field(1.5, ge=1, description="PER/SD above which a gap from PER is flagged as far too large")
    classes: dict[str, float] = Field(
        {"severe": 0.5, "high": 1.0, "moderate": 1.5, "low": float("inf")},
        description="risk class -> largest gap/demand ratio that belongs to it, in ascending order",
    )
    interpolation: Interpolation = Interpolation()
    codes: Codes = Codes()

    @field_validator("classes")
    @classmethod
    def _ascending(cls, classes: dict[str, float]) -> dict[str, float]:
        thresholds = list(classes.values())
        if not thresholds or thresholds != sorted(thresholds):
            raise ValueError(f"thresholds must be in ascending order, got {classes}")
        return classes


class Design(Section):
    """A screening by a design or user spectrum instead of records."""

    spectrum: RelativePath = Field(description="CSV: period (s), damping, and sd (m) or psa (m/s2)")
    pairs: RelativePath = Field(description="pair table, CSV or Parquet")
    output: RelativePath = Field(description="folder of the results")
    building: Building = Building()
    screening: Screening = Screening()


class Pairs(Section):
    """Where the pairs of buildings come from: a stored table, or a simulated one around the stations."""

    file: RelativePath | None = Field(None, description="pair table, CSV or Parquet")
    simulated: SimulatedPairs | None = Field(None, description="simulated inventory around the stations")

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.file is None) == (self.simulated is None):
            raise ValueError("give either file or simulated")
        return self


class Totals(Section):
    """How pairs are counted by area."""

    cell: float = Field(1000.0, gt=0, description="m, size of the cells of a grid")
    area: str | None = Field(None, description="column of the pair table that names the area, instead of cells")


class Simulation(Section):
    """A simulated earthquake, its stations, and the pairs of buildings around them."""

    scenario: Scenario = Scenario()
    pairs: SimulatedPairs = SimulatedPairs()


class Run(Section):
    """Everything one run needs."""

    name: str = Field(min_length=1, description="title of tables and figures")
    output: RelativePath = Field(description="folder of the results")
    workers: int = Field(0, ge=0, description="processes; 0: one a processor")
    simulation: RelativePath | None = Field(None, description="TOML file of an event to simulate instead of records")
    records: Records | None = Field(None, description="where the records are")
    pairs: Pairs | None = Field(None, description="where the pairs come from, if not from the simulation")
    processing: Processing = Processing()
    spectra: Spectra = Spectra()
    building: Building = Building()
    screening: Screening = Screening()
    totals: Totals = Totals()
    geopackage: bool = Field(False, description="write risk.gpkg for QGIS too; needs per_obspy[gis]")

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.simulation is None) == (self.records is None):
            raise ValueError("give either simulation or records")
        if self.records is not None and self.pairs is None:
            raise ValueError("give pairs: a file, or how to simulate them")
        return self


SectionType = TypeVar("SectionType", bound=Section)


def load(path: Path, section: type[SectionType]) -> SectionType:
    """
    Read a configuration.

    Parameters
    ----------
    path : Path
        TOML file; paths in it are relative to its folder.
    section : type of Section
        What the file holds: :class:`Run` or :class:`Simulation`.

    Raises
    ------
    CatalogError
        If the file cannot be read, or naming every key that is unknown, missing or has a wrong value.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CatalogError(str(path), f"cannot be read as TOML: {error}") from error
    return checked(section, content, str(path), path.resolve().parent)


def checked(
    section: type[SectionType], content: dict[str, object], source: str = "command line", folder: Path | None = None
) -> SectionType:
    """
    Return the settings of a section.

    Parameters
    ----------
    section : type of Section
        What the content belongs to.
    content : dict
        Key to value, as TOML gives it.
    source : str
        Where the content comes from, for the error.
    folder : Path, optional
        What paths are relative to.

    Raises
    ------
    CatalogError
        Naming every key that is unknown, missing or has a wrong value.
    """
    try:
        return section.model_validate(content, context=folder and {"folder": folder})
    except ValidationError as error:
        raise CatalogError(source, "; ".join(_fault(fault) for fault in error.errors())) from error


def _fault(fault: ErrorDetails) -> str:
    """Return one fault of a configuration: key, what is wrong, value."""
    key = ".".join(map(str, fault["loc"])) or "the file"
    given = "" if fault["type"] in {"missing", "value_error"} else f" (got {fault['input']!r:.60})"
    unknown = "unknown key" if fault["type"] == "extra_forbidden" else fault["msg"]
    return f"{key}: {unknown}{given}"
