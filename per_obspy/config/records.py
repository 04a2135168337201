"""Settings of the sources of records."""

from typing import Annotated, Self

from pydantic import (
    Field,
    PlainSerializer,
    field_validator,
    model_validator,
)

from per_obspy.config.section import Latitude, Longitude, Moment, RelativePath, Section
from per_obspy.names import code_problem, public_url
from per_obspy.units import motion_unit

#: A provider of services, which records of a run show without user and password.
Provider = Annotated[str, PlainSerializer(public_url)]

#: Host of a SeedLink server, with its port where that is not 18000.
SeedLinkServer = Annotated[str, Field(pattern=r"^(seedlink://)?[A-Za-z0-9.-]{1,253}(:\d{1,5})?/?$")]


#: Station as NET.STA, and station or channel as NET.STA.LOC.CHA with wildcards.
StationName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]*\.[A-Za-z0-9_-]+$")]
StationOrChannel = Annotated[
    str,
    Field(pattern=r"^[A-Za-z0-9_-]*\.[A-Za-z0-9_-]+(\.[A-Za-z0-9_?*-]*\.[A-Za-z0-9_?*-]+)?$"),
]


class Columns(Section):
    """Form of a plain table of samples (``records/text_table.py``)."""

    file: RelativePath = Field(
        description="text file of samples; all rows have the same number of values"
    )
    network: str = Field("", description="SEED network code: letters, digits, - and _")
    station: str = Field(description="SEED station code: letters, digits, - and _")
    latitude: Latitude = Field(description="latitude of the station, degrees north")
    longitude: Longitude = Field(description="longitude of the station, degrees east")
    units: str = Field(description="unit of the samples: m/s2, cm/s2, gal or g")
    channels: dict[str, Annotated[int, Field(ge=0, le=10_000)]] = Field(
        description="column of each channel, counted from 0: channel code = column"
    )
    azimuths: dict[str, Annotated[float, Field(ge=-720, le=720)]] = Field(
        default_factory=dict,
        description="azimuth of each channel, degrees clockwise from north: channel code = azimuth",
    )
    separator: str | None = Field(
        None, description="character between columns; white space if not set"
    )
    skip: int = Field(0, ge=0, le=1_000_000_000, description="number of header lines to skip")
    time_column: int | None = Field(
        None, ge=0, le=10_000, description="column of time in s, checked for even spacing"
    )
    dt: float | None = Field(
        None, gt=0, le=3600, description="sampling interval, s, for tables without a time column"
    )
    start: str | None = Field(None, description="time of the first sample, ISO 8601, UTC")
    raw: bool = Field(False, description="whether the record is uncorrected")
    layout: str | None = Field(
        None,
        pattern="^(columns|rows)$",
        description=(
            "order of the samples: columns (one row per sample, one column per channel) or rows "
            "(samples of one channel, several per row, read row after row; needs dt and "
            "channels = { CODE = 0 }; the last row may be shorter); not given: columns"
        ),
    )

    @field_validator("units")
    @classmethod
    def _acceleration(cls, units: str) -> str:
        unit = motion_unit(units)
        if unit is None or unit.quantity != "acceleration":
            problem = f"{units!r} is no unit of acceleration, such as m/s2, cm/s2, gal and g"
            raise ValueError(problem)
        return units

    @model_validator(mode="after")
    def _usable_codes(self) -> Self:
        for channel in self.channels:
            if problem := code_problem(self.network, self.station, "", channel):
                raise ValueError(problem)
        return self

    @model_validator(mode="after")
    def _one_interval(self) -> Self:
        if (self.time_column is None) == (self.dt is None):
            raise ValueError("give exactly one of time_column and dt")
        return self

    @model_validator(mode="after")
    def _channels_fit_layout(self) -> Self:
        if self.layout == "rows" and list(self.channels.values()) != [0]:
            raise ValueError(
                f'layout = "rows" holds one channel: give channels = {{ CODE = 0 }}, '
                f"got {self.channels}"
            )
        if self.layout == "rows" and self.time_column is not None:
            raise ValueError('layout = "rows" has no time_column: give dt instead')
        return self


class Window(Section):
    """Time window; missing limits follow from the origin time of the event."""

    start: Moment | None = Field(
        None,
        description=(
            "start of the time window, ISO 8601, UTC; if not set: `before` seconds before "
            "the origin time"
        ),
    )
    end: Moment | None = Field(
        None,
        description=(
            "end of the time window, ISO 8601, UTC; if not set: `after` seconds after the "
            "origin time"
        ),
    )
    before: float = Field(
        30.0, ge=0, le=86_400, description="time from the start of the window to the origin time, s"
    )
    after: float = Field(
        300.0, gt=0, le=86_400, description="time from the origin time to the end of the window, s"
    )


class Fdsn(Window):
    """Records from FDSN web services around an epicentre; downloads stay in the cache."""

    providers: tuple[Provider, ...] = Field(
        min_length=1,
        description=(
            "services in order of preference: names known to ObsPy, base URLs, eida- "
            "routing, earthscope-federator"
        ),
    )
    cache: RelativePath = Field(description="folder that keeps all downloads")
    seedlink: tuple[SeedLinkServer, ...] = Field(
        (),
        description=(
            "SeedLink servers (host or host:port; port 18000 if not set) for records of "
            "listed stations that no provider has, as in the first minutes after an "
            "earthquake"
        ),
    )
    event_id: str | None = Field(
        None,
        description="identifier of the earthquake at the event service, instead of records.event",
    )
    event_provider: Provider = Field(
        "USGS", description="event service: a name known to ObsPy, or a base URL"
    )
    shakemap: bool = Field(
        False,
        description=(
            "whether the ShakeMap of the earthquake is fetched too, from the event service of the "
            "USGS; a file in records.shakemap takes its place"
        ),
    )
    shakemap_version: int | None = Field(
        None, ge=1, le=100_000, description="version of the ShakeMap; if not set, the preferred one"
    )
    latitude: float | None = Field(
        None,
        ge=-90,
        le=90,
        description="latitude of the centre, degrees north; if not set, the epicentre",
    )
    longitude: float | None = Field(
        None,
        ge=-180,
        le=180,
        description="longitude of the centre, degrees east; if not set, the epicentre",
    )
    radius: float = Field(
        100_000.0, gt=0, le=20_000_000, description="radius of the circle of the search, m"
    )
    networks: tuple[str, ...] = Field(
        ("*",), min_length=1, description="SEED network codes; * and ? are wildcards"
    )
    stations: tuple[str, ...] = Field(
        ("*",), min_length=1, description="SEED station codes; * and ? are wildcards"
    )
    locations: tuple[str, ...] = Field(
        ("*",),
        min_length=1,
        description="SEED location codes; * and ? are wildcards; an empty code is --",
    )
    channels: tuple[str, ...] = Field(
        ("HN?", "BN?", "CN?", "EN?"),
        min_length=1,
        description="SEED channel codes; * and ? are wildcards; accelerometers by default",
    )
    timeout: float = Field(
        60.0, gt=0, le=3600, description="longest time without an answer, or without more of it, s"
    )
    retries: int = Field(
        5,
        ge=0,
        le=100,
        description=(
            "number of further attempts after a temporary fault (429, 5xx, time-out, cut answer)"
        ),
    )
    wait: float = Field(
        1.0,
        ge=0,
        le=3600,
        description=(
            "time before the second attempt, s; it doubles with each further one, and "
            "Retry-After counts"
        ),
    )
    connections: int = Field(
        3, ge=1, le=16, description="number of stations requested at the same time"
    )

    @property
    def knows_where_and_when(self) -> bool:
        """Whether centre and window are given, so that no event is needed."""
        return None not in (self.latitude, self.longitude, self.start, self.end)


class Sds(Window):
    """A time window of an SDS archive."""

    folder: RelativePath = Field(
        description="root of the archive, which contains YEAR/NET/STA/CHAN.D/"
    )


class Asdf(Section):
    """A workspace of gmprocess, or another ASDF file."""

    file: RelativePath = Field(description="HDF5 file of the workspace")
    tag: str = Field(
        "*_unprocessed",
        description=(
            "tag of the waveforms; * and ? are wildcards; *_default is the processed result "
            "of gmprocess"
        ),
    )


class Archives(Section):
    """Limits of unpacking the archives of a folder."""

    largest_member: int = Field(
        512 * 2**20,
        gt=0,
        le=2**50,
        description=(
            "largest size of one unpacked file of an archive, bytes; larger files are left out"
        ),
    )
    largest_total: int = Field(
        8 * 2**30,
        gt=0,
        le=2**50,
        description=(
            "largest size of all unpacked files of an archive, bytes; larger archives are left out"
        ),
    )
    largest_ratio: float = Field(
        200.0,
        ge=1,
        le=1e6,
        description=(
            "largest ratio of unpacked to packed size of an archive, checked from 64 MiB "
            "on; archives above it are left out"
        ),
    )


class Records(Section):
    """Sources of the records; several may be set."""

    folder: RelativePath | None = Field(
        None,
        description=(
            "folder of waveform files, which may also hold StationXML and tables of stations"
        ),
    )
    stationxml: RelativePath | None = Field(
        None,
        description=(
            "StationXML file or folder, or a CSV table of stations, if not in the folder of "
            "the records"
        ),
    )
    event: RelativePath | None = Field(
        None, description="QuakeML file of the earthquake; a run without one is possible"
    )
    time: Moment | None = Field(
        None,
        description=(
            "time of the earthquake to screen where the folder holds several, ISO 8601, "
            "UTC: within its records or up to event_gap before them; if not set: origin "
            "time of the event, or else the earthquake of most stations"
        ),
    )
    event_gap: float = Field(
        300.0,
        gt=0,
        le=86_400,
        description=(
            "records of the folder that start within this time of the first one belong to "
            "one earthquake, s; increase it where clocks of stations are wrong"
        ),
    )
    settle: float = Field(
        0.0,
        ge=0,
        le=86_400,
        description=(
            "age of a file of the folder, s, from which it is read: one that was changed "
            "later, or changes while it is read, waits for the next run; 0: every file is "
            "read"
        ),
    )
    without: tuple[StationOrChannel, ...] = Field(
        (),
        description=(
            "stations (NET.STA) and channels (NET.STA.LOC.CHA; * and ? are wildcards) that are "
            "left out; each is a row of rejected.csv"
        ),
    )
    trust: tuple[StationName, ...] = Field(
        (),
        description=(
            "stations (NET.STA) whose records are used although their peaks, places or "
            "components are implausible; they keep their flags"
        ),
    )
    archives: Archives = Field(Archives(), description="limits of archives in the folder")
    columns: tuple[Columns, ...] = Field((), description="plain tables of samples")
    fdsn: Fdsn | None = Field(None, description="FDSN web services")
    sds: Sds | None = Field(None, description="SDS archive")
    asdf: Asdf | None = Field(None, description="ASDF workspace of gmprocess")
    shakemap: RelativePath | None = Field(
        None,
        description=(
            "grid.xml of a USGS ShakeMap, also .gz: the motion of pairs without a station in reach"
        ),
    )
    shakemap_uncertainty: RelativePath | None = Field(
        None, description="uncertainty.xml of the same ShakeMap"
    )

    stationlist: RelativePath | None = Field(
        None,
        description=(
            "stationlist.json of a USGS ShakeMap: amplitudes of stations without a record, for "
            "pairs that no record reaches, or only one beyond screening.flag_distance"
        ),
    )

    @model_validator(mode="after")
    def _any_source(self) -> Self:
        records = (self.folder, self.columns, self.fdsn, self.sds, self.asdf)
        if not any((*records, self.shakemap, self.stationlist)):
            raise ValueError(
                "give at least one of folder, columns, fdsn, sds, asdf, shakemap and stationlist"
            )
        return self

    @model_validator(mode="after")
    def _used_or_not(self) -> Self:
        if both := sorted({*self.without} & {*self.trust}):
            raise ValueError(f"{both[0]} is in both without and trust: give one of them")
        return self

    @model_validator(mode="after")
    def _known_window(self) -> Self:
        if self.fdsn and not (self.fdsn.knows_where_and_when or self.fdsn.event_id or self.event):
            raise ValueError("fdsn needs event_id, or event, or latitude, longitude, start and end")
        if self.sds and not (self.event or (self.sds.start and self.sds.end)):
            raise ValueError("sds needs start and end, or event")
        if self.shakemap_uncertainty and not self.shakemap:
            raise ValueError("shakemap_uncertainty belongs to a shakemap: give both")
        return self
