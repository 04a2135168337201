"""Settings of the watcher and of its messages: earthquakes that matter, times of runs, notice."""

import re
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, field_validator, model_validator

from per_obspy.config.records import Provider
from per_obspy.config.section import Language, Latitude, Longitude, RelativePath, Section
from per_obspy.constants import LANGUAGES


class Reach(Section):
    """One line of the table of magnitudes: how strong an earthquake within a distance must be."""

    distance: float = Field(
        gt=0,
        le=20_000_000,
        description="distance from the epicentre to the nearest pair of the inventory, m",
    )
    magnitude: float = Field(
        ge=-2,
        le=10,
        description="smallest magnitude of an earthquake that matters within the distance",
    )


class Region(Section):
    """Circle in place of the inventory, where its pairs are not in a table or catalogue."""

    latitude: Latitude = Field(description="latitude of the centre, degrees north")
    longitude: Longitude = Field(description="longitude of the centre, degrees east")
    radius: float = Field(
        0.0,
        ge=0,
        le=20_000_000,
        description="radius of the circle, m; distances are measured from the circle",
    )


#: Smallest magnitudes by distance: a choice of this package, without a source.
REACHES = tuple(
    Reach(distance=1000.0 * distance, magnitude=magnitude)
    for distance, magnitude in ((30, 4.5), (100, 5.5), (200, 6.5), (500, 7.5))
)


class Watch(Section):
    """Earthquakes that `per-obspy watch` looks for, and the times of their runs."""

    service: Provider | None = Field(
        None,
        description=(
            "FDSN event service: a name known to ObsPy, or a base URL; either service or "
            "folder is needed"
        ),
    )
    folder: RelativePath | None = Field(
        None, description="folder of QuakeML files (.xml, .quakeml), instead of service"
    )
    region: Region | None = Field(
        None,
        description=(
            "circle that contains the inventory; if not set, the places of its pairs, which "
            "a table or a catalogue contains"
        ),
    )
    magnitudes: tuple[Reach, ...] = Field(
        REACHES,
        min_length=1,
        description=(
            "smallest magnitude by distance; earthquakes beyond the largest distance are left out"
        ),
    )
    assumed_magnitude: float = Field(
        6.0,
        ge=-2,
        le=10,
        description="magnitude assumed for an earthquake without one, to decide whether it matters",
    )
    delays: tuple[Annotated[float, Field(le=315_360_000)], ...] = Field(
        (120.0, 300.0, 900.0, 3600.0, 86_400.0),
        min_length=1,
        description="times from the origin time to each run, s, ascending",
    )
    latency: float = Field(
        60.0,
        ge=0,
        le=315_360_000,
        description=(
            "time that records need to reach their service, s: the window of a run ends "
            "this long before its delay, unless the configured window ends earlier"
        ),
    )
    poll: float = Field(
        60.0, ge=1, le=86_400, description="time between two polls of the list of earthquakes, s"
    )
    records_poll: float = Field(
        120.0,
        ge=1,
        le=86_400,
        description=(
            "shortest time between two requests for missing records of an earthquake between the "
            "delays, s; it grows to a tenth of the time since the origin"
        ),
    )
    oldest: float = Field(
        7 * 86_400.0,
        gt=0,
        le=315_360_000,
        description="age of an earthquake beyond which it is neither opened nor polled, s",
    )
    aftershocks: bool = Field(
        False,
        description=(
            "start an earthquake within the time and distance of an earlier one (Gardner & "
            "Knopoff 1974) from the damage that its newest results show"
        ),
    )
    updatedafter: bool = Field(
        True, description="request only earthquakes that changed since the last poll"
    )

    @field_validator("delays")
    @classmethod
    def _rising(cls, delays: tuple[float, ...]) -> tuple[float, ...]:
        if any(later <= earlier for earlier, later in zip((0.0, *delays), delays, strict=False)):
            raise ValueError(f"delays must be positive and rise, got {list(delays)}")
        return delays

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.service is None) == (self.folder is None):
            raise ValueError("give either service (an FDSN event service) or folder (of QuakeML)")
        if self.latency >= self.delays[0]:
            raise ValueError(
                f"latency must be shorter than the first delay, {self.delays[0]:g} s: "
                "no record would have arrived"
            )
        return self


#: Kinds of messages.
Kind = Literal["first", "changed", "failure"]

#: Credentials inside an address, which other users of the machine see among its processes.
_CREDENTIALS = re.compile(r"://[^/\s]*@|(token|password|passwd|secret|api_?key)=", re.IGNORECASE)


def _without_secret(argument: str) -> str:
    """Return an argument of a command that holds no address with a password or token."""
    if _CREDENTIALS.search(argument):
        raise ValueError(
            "an argument holds a password or token, which every process list shows: let the "
            "command read it from its environment"
        )
    if "\0" in argument:
        raise ValueError("an argument holds a NUL character")
    return argument


Argument = Annotated[str, AfterValidator(_without_secret)]


class AppriseUrls(Section):
    """Where the addresses of Apprise are, which hold secrets."""

    apprise_urls_variable: str | None = Field(
        None,
        pattern="^[A-Za-z_][A-Za-z0-9_]*$",
        description=(
            "name of the environment variable with Apprise URLs, separated by blanks; needs "
            "per_obspy[notify]"
        ),
    )
    apprise_urls_file: RelativePath | None = Field(
        None,
        description=(
            "file with one Apprise URL per line, which only its owner may read (chmod 600); needs "
            "per_obspy[notify]"
        ),
    )

    @model_validator(mode="after")
    def _one_list_of_urls(self) -> Self:
        if self.apprise_urls_variable and self.apprise_urls_file:
            raise ValueError("give either apprise_urls_variable or apprise_urls_file")
        return self


class Group(AppriseUrls):
    """People who get messages about the pairs of their area, and only about bad ones."""

    name: str = Field(min_length=1, max_length=80, description="name in messages, unique")
    address: str = Field(
        "", description="address that notify.command gets as PER_OBSPY_ADDRESS; or use Apprise URLs"
    )
    area: RelativePath | None = Field(
        None,
        description=(
            "file of polygons (GeoJSON or WKT; longitude and latitude, degrees) that contain the "
            "middle of a pair; needs per_obspy[gis]"
        ),
    )
    where: dict[str, str] = Field(
        default_factory=dict, description="column of the risk table = its value"
    )
    least_class: str = Field(description="least risk class that counts, of screening.classes")
    least_count: int = Field(
        1,
        ge=1,
        le=1_000_000_000,
        description="number of pairs of this class or worse from which there is a message",
    )
    language: Language = Field("en", description=f"of the messages: {' or '.join(LANGUAGES)}")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if bool(self.address) == bool(self.apprise_urls_variable or self.apprise_urls_file):
            raise ValueError("give either address, or Apprise URLs by a variable or file")
        return self


class Notify(AppriseUrls):
    """Messages about first results, changed class counts and failures (docs/operation.md)."""

    on: tuple[Kind, ...] = Field(
        ("first", "changed", "failure"),
        description=(
            "occasions of messages: first (first result), changed (number of pairs in a "
            "class changed), failure"
        ),
    )
    command: tuple[Argument, ...] = Field(
        (),
        description=(
            "program and arguments, started without a shell; the message is its standard "
            "input, and PER_OBSPY_KIND, PER_OBSPY_TITLE, PER_OBSPY_FOLDER, PER_OBSPY_REPORT, "
            "PER_OBSPY_GROUP and PER_OBSPY_ADDRESS are in its environment"
        ),
    )
    groups: tuple[Group, ...] = Field(
        (), description="people of an area, each with a threshold, a language and an address"
    )
    timeout: float = Field(
        30.0, gt=0, le=600, description="longest time of a command or delivery, s"
    )

    @property
    def is_silent(self) -> bool:
        """Whether no way to notify is configured."""
        ways = (self.command, self.apprise_urls_variable, self.apprise_urls_file, self.groups)
        return not self.on or not any(ways)

    @model_validator(mode="after")
    def _usable_ways(self) -> Self:
        names = [group.name for group in self.groups]
        # What groups were told last is known by their names
        for group in self.groups:
            if names.count(group.name) > 1:
                raise ValueError(f"groups: the name {group.name!r} occurs twice")
            if group.address and not self.command:
                raise ValueError(
                    f"groups: {group.name!r} has an address: give command, which uses it"
                )
        if self.command and not self.command[0].strip():
            raise ValueError("command: its first word, the program, is empty")
        return self
