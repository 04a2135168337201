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
        description="m, from the epicentre to the nearest pair of the inventory",
    )
    magnitude: float = Field(
        ge=-2, le=10, description="smallest magnitude of an earthquake that matters within it"
    )


class Region(Section):
    """Circle in place of the inventory, where its pairs are not in a table or catalogue."""

    latitude: float = Field(ge=-90, le=90, description="centre, degrees north")
    longitude: float = Field(ge=-180, le=180, description="centre, degrees east")
    radius: float = Field(
        0.0, ge=0, le=20_000_000, description="m; distances are measured from the circle"
    )


#: Chosen so that PGA at the distance is about 0.02 g by usual ground-motion models: no source.
REACHES = tuple(
    Reach(distance=1000.0 * distance, magnitude=magnitude)
    for distance, magnitude in ((30, 4.5), (100, 5.5), (200, 6.5), (500, 7.5))
)


class Watch(Section):
    """Earthquakes that `per-obspy watch` looks for, and the times of their runs."""

    service: Provider | None = Field(
        None, description="FDSN event service: ObsPy's name or base URL; or else give folder"
    )
    folder: RelativePath | None = Field(
        None, description="folder of QuakeML files (.xml, .quakeml), instead of service"
    )
    region: Region | None = Field(
        None,
        description=(
            "circle of the inventory; not given: the places of its pairs, which a table or a "
            "catalogue has"
        ),
    )
    magnitudes: tuple[Reach, ...] = Field(
        REACHES,
        min_length=1,
        description="smallest magnitude by distance; beyond the largest distance none matters",
    )
    assumed_magnitude: float = Field(
        6.0,
        ge=-2,
        le=10,
        description="of an earthquake of unknown magnitude, to decide whether it matters",
    )
    delays: tuple[float, ...] = Field(
        (120.0, 300.0, 900.0, 3600.0, 86_400.0),
        min_length=1,
        description="s from the origin time to each run, rising",
    )
    latency: float = Field(
        60.0,
        ge=0,
        description=(
            "s that records need to reach their service: the window of a run ends this long "
            "before its delay, unless the configured window is over before"
        ),
    )
    poll: float = Field(60.0, ge=1, le=86_400, description="s between two looks at the earthquakes")
    confirm: float = Field(
        900.0,
        ge=1,
        description="s after which an open earthquake is asked for by its identifier",
    )
    oldest: float = Field(
        7 * 86_400.0,
        gt=0,
        description="s since the origin time after which an earthquake is not opened or polled",
    )
    most_events: int = Field(
        20_000,
        ge=1,
        description="largest number of earthquakes that a service is asked for at once",
    )
    updatedafter: bool = Field(
        True, description="ask a service only for what changed since the last poll"
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
