"""
Every default of a run, with its unit and where it comes from; read from TOML.

Only ``run.py`` and ``cli.py`` see a configuration as a whole. Rooms below take plain arguments. Paths in a
configuration are relative to the folder of its file.
"""

from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field


class Section(BaseModel):
    """A frozen group of settings; an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Columns(Section):
    """How to read a plain table of samples (``records/columns.py``)."""

    file: Path = Field(description="text file, one row a sample")
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


class Records(Section):
    """Where the records are."""

    folder: Path | None = Field(None, description="folder of waveform files, with StationXML beside them")
    stationxml: Path | None = Field(None, description="StationXML file or folder, if not beside the records")
    event: Path | None = Field(None, description="QuakeML file; no event is fine")
    columns: tuple[Columns, ...] = Field((), description="plain tables of samples")


class Processing(Section):
    """The chain from raw record to one that spectra may be computed from (Boore 2005; gmprocess 2.8)."""

    highpass: float = Field(0.08, gt=0, description="corner, Hz")
    lowpass: float = Field(40.0, gt=0, description="corner, Hz; never above 0.75 of Nyquist")
    order: int = Field(5, ge=1, le=20, description="n of the Butterworth amplitude 1/sqrt(1+(f_hp/f)^2n)")
    taper: float = Field(0.05, ge=0, le=0.5, description="fraction of the record at each end, Hann")
    usable: float = Field(0.8, gt=0, le=1, description="longest usable period = usable / f_hp")
    pre_event: float = Field(0.0, ge=0, description="s at the start that are noise; 0: mean of the whole record")
    gain_tolerance: float = Field(0.1, gt=0, description="between product of stage gains and sensitivity, relative")
    overlap: float = Field(0.8, gt=0, le=1, description="part of the longer horizontal that both must cover")


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
    floor_tolerance: float = Field(0.6, ge=0, description="m; floors further apart than 2 ft misalign (FEMA P-154)")
    period_formula: str = Field("asce7", pattern="^(asce7|ec8)$", description="asce7 or ec8; medians, not lower bounds")


class Screening(Section):
    """How pairs find their ground motion and how risk is named."""

    largest_distance: float = Field(20_000.0, gt=0, description="m from station to pair; pairs beyond are rejected")
    flag_distance: float = Field(5_000.0, gt=0, description="m, flagged beyond")
    per_to_sd: float = Field(1.5, ge=1, description="PER/SD above which a gap from PER is flagged as far too large")
    classes: dict[str, float] = Field(
        {"severe": 0.5, "high": 1.0, "moderate": 1.5, "low": float("inf")},
        description="risk class -> largest gap/demand ratio that belongs to it, in ascending order",
    )
