"""Settings of the watcher: list of earthquakes, magnitudes that matter, times of runs."""

from typing import Self

from pydantic import Field, field_validator, model_validator

from per_obspy.config.records import Provider
from per_obspy.config.section import RelativePath, Section


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

    latitude: float = Field(ge=-90, le=90, description="latitude of the centre, degrees north")
    longitude: float = Field(ge=-180, le=180, description="longitude of the centre, degrees east")
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
    delays: tuple[float, ...] = Field(
        (120.0, 300.0, 900.0, 3600.0, 86_400.0),
        min_length=1,
        description="times from the origin time to each run, s, ascending",
    )
    latency: float = Field(
        60.0,
        ge=0,
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
    confirm: float = Field(
        900.0,
        ge=1,
        description="time after which an open earthquake is requested by its identifier, s",
    )
    oldest: float = Field(
        7 * 86_400.0,
        gt=0,
        description="age of an earthquake beyond which it is neither opened nor polled, s",
    )
    most_events: int = Field(
        20_000,
        ge=1,
        description="largest number of earthquakes in one request",
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
