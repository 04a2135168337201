"""Where records come from."""

from typing import Annotated, Self

from pydantic import (
    Field,
    PlainSerializer,
    model_validator,
)

from per_obspy.config.section import Moment, RelativePath, Section
from per_obspy.names import code_problem, public_url

#: A provider of services, which records of a run show without user and password.
Provider = Annotated[str, PlainSerializer(public_url)]

#: Host of a SeedLink server, with its port where that is not 18000.
SeedLinkServer = Annotated[str, Field(pattern=r"^(seedlink://)?[A-Za-z0-9.-]{1,253}(:\d{1,5})?/?$")]


class Columns(Section):
    """How to read a plain table of samples (``records/text_table.py``)."""

    file: RelativePath = Field(description="text file of samples, all rows with as many values")
    network: str = Field("", description="SEED network code: letters, digits, - and _")
    station: str = Field(description="SEED station code: letters, digits, - and _")
    latitude: float = Field(ge=-90, le=90, description="degrees north")
    longitude: float = Field(ge=-180, le=180, description="degrees east")
    units: str = Field(
        pattern="^(m/s2|cm/s2|gal|g)$", description="of the samples: m/s2, cm/s2, gal, g"
    )
    channels: dict[str, int] = Field(description="channel code -> column, counted from 0")
    azimuths: dict[str, float] = Field(
        default_factory=dict, description="channel code -> degrees from north"
    )
    separator: str | None = Field(None, description="between columns; white space if not given")
    skip: int = Field(0, ge=0, description="header lines")
    time_column: int | None = Field(
        None, ge=0, description="column of time in s, checked for even spacing"
    )
    dt: float | None = Field(
        None, gt=0, description="sampling interval in s, where there is no time column"
    )
    start: str | None = Field(None, description="time of the first sample, ISO 8601, UTC")
    raw: bool = Field(False, description="not corrected yet")
    layout: str | None = Field(
        None,
        pattern="^(columns|rows)$",
        description=(
            "order of the samples: columns (one row per sample, one column per channel) or rows "
            "(samples of one channel, several per row, read row after row; needs dt and "
            "channels = { CODE = 0 }; the last row may be shorter); not given: columns"
        ),
    )

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
    """A time window; what is not given is seen from the origin time of the event."""

    start: Moment | None = Field(
        None, description="ISO 8601, UTC; not given: before the origin time"
    )
    end: Moment | None = Field(None, description="ISO 8601, UTC; not given: after the origin time")
    before: float = Field(
        30.0, ge=0, description="s from the start of the window to the origin time"
    )
    after: float = Field(300.0, gt=0, description="s from the origin time to the end of the window")


class Fdsn(Window):
    """Records from FDSN web services around an epicentre; what was fetched stays in the cache."""

    providers: tuple[Provider, ...] = Field(
        min_length=1,
        description=(
            "in order of preference: ObsPy's names, base URLs, eida-routing, earthscope-federator"
        ),
    )
    cache: RelativePath = Field(description="folder that keeps what was fetched")
    seedlink: tuple[SeedLinkServer, ...] = Field(
        (),
        description=(
            "SeedLink servers (host or host:port; port 18000 if none) that are asked for records "
            "of listed stations which no provider has, as minutes after an earthquake"
        ),
    )
    event_id: str | None = Field(None, description="of the event service, instead of records.event")
    event_provider: Provider = Field(
        "USGS", description="ObsPy's name or base URL of the event service"
    )
    latitude: float | None = Field(
        None, ge=-90, le=90, description="centre, degrees north; not given: epicentre"
    )
    longitude: float | None = Field(
        None, ge=-180, le=180, description="centre, degrees east; not given: epicentre"
    )
    radius: float = Field(
        100_000.0, gt=0, le=20_000_000, description="m, of the circle in which stations are wanted"
    )
    networks: tuple[str, ...] = Field(
        ("*",), min_length=1, description="SEED codes, * and ? allowed"
    )
    stations: tuple[str, ...] = Field(
        ("*",), min_length=1, description="SEED codes, * and ? allowed"
    )
    locations: tuple[str, ...] = Field(
        ("*",), min_length=1, description="SEED codes, * and ? allowed; empty: --"
    )
    channels: tuple[str, ...] = Field(
        ("HN?", "BN?", "CN?", "EN?"),
        min_length=1,
        description="SEED codes, * and ? allowed; accelerometers",
    )
    timeout: float = Field(60.0, gt=0, description="s without an answer, or without more of it")
    longest_answer: float = Field(
        600.0, gt=0, description="s, of one attempt in all; a slower answer is given up"
    )
    largest_answer: int = Field(
        256 * 2**20, gt=0, description="bytes after unpacking; a larger answer is given up"
    )
    retries: int = Field(
        5, ge=0, description="after a fault that may pass (429, 5xx, time-out, cut answer)"
    )
    wait: float = Field(
        1.0,
        ge=0,
        description="s; the second retry waits twice as long, and so on; Retry-After counts",
    )
    longest_pause: float | None = Field(
        None,
        ge=0,
        description=(
            "s; a service that demands a longer pause (Retry-After) is left for another time; not "
            "given: it is asked again after at most 600 s"
        ),
    )
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
    tag: str = Field(
        "*_unprocessed",
        description="of the waveforms, * and ? allowed; *_default is gmprocess's result",
    )


class Archives(Section):
    """How much the archives of a folder may unpack to."""

    largest_member: int = Field(
        512 * 2**20, gt=0, description="bytes, of one file of an archive; larger ones are left out"
    )
    largest_total: int = Field(
        8 * 2**30, gt=0, description="bytes, of all files of an archive; a larger one is left out"
    )
    largest_ratio: float = Field(
        200.0,
        ge=1,
        description=(
            "unpacked size of an archive over its own, from 64 MiB on; one of a larger ratio is "
            "left out"
        ),
    )
    most_members: int = Field(
        1_000_000, gt=0, description="files of an archive; one of more is left out"
    )
    most_levels: int = Field(
        3,
        ge=1,
        le=5,
        description=(
            "levels of archives inside archives, whose files share the limits of the outermost; "
            "1: none inside another is opened"
        ),
    )


class Records(Section):
    """Where the records are; several sources may be given."""

    folder: RelativePath | None = Field(
        None, description="folder of waveform files, with StationXML beside them"
    )
    stationxml: RelativePath | None = Field(
        None,
        description=(
            "StationXML file or folder, or a CSV table of stations, if not beside the records"
        ),
    )
    event: RelativePath | None = Field(None, description="QuakeML file; no event is fine")
    time: Moment | None = Field(
        None,
        description=(
            "ISO 8601, UTC: the earthquake to screen where the folder holds several, by a time "
            "within its records or up to event_gap before; not given: origin time of the event, or "
            "else the earthquake of most stations"
        ),
    )
    event_gap: float = Field(
        300.0,
        gt=0,
        le=86_400,
        description=(
            "s; records of the folder that start within it of the first one are of one earthquake; "
            "longer where clocks of stations are wrong"
        ),
    )
    settle: float = Field(
        0.0,
        ge=0,
        le=86_400,
        description=(
            "s; a file of the folder that was changed less than this ago, or changes while it is "
            "read, waits for the next run; for folders that grow; 0: every file is read"
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
            "grid.xml of a USGS ShakeMap, also .gz: the demand of pairs without a station in reach"
        ),
    )
    shakemap_uncertainty: RelativePath | None = Field(
        None, description="uncertainty.xml of the same ShakeMap"
    )

    @model_validator(mode="after")
    def _any_source(self) -> Self:
        if not any((self.folder, self.columns, self.fdsn, self.sds, self.asdf, self.shakemap)):
            raise ValueError("give at least one of folder, columns, fdsn, sds, asdf and shakemap")
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
