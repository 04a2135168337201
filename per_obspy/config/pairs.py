"""Pairs of a run: tables, simulated inventories and rows of buildings."""

from datetime import datetime
from typing import Literal, Self

from pydantic import (
    Field,
    field_validator,
    model_validator,
)

from per_obspy.config.section import Latitude, Longitude, RelativePath, Section


class Scenario(Section):
    """A simulated earthquake and the stations that record it (stochastic method, Boore 2003)."""

    seed: int = Field(
        20,
        ge=0,
        le=2**63 - 1,
        description="of every random number; the same seed gives the same samples",
    )
    name: str = Field("Simulated earthquake", description="of the event")
    magnitude: float = Field(7.0, ge=4, le=8.5, description="moment magnitude")
    origin_time: str = Field("2000-01-01T00:00:00", description="ISO 8601, UTC")
    latitude: Latitude = Field(0.0, description="of the epicentre, degrees north")
    longitude: Longitude = Field(0.0, description="of the epicentre, degrees east")
    depth: float = Field(15_000.0, ge=0, le=700_000, description="m")
    quality: float = Field(180.0, gt=0, le=1e5, description="Q at 1 Hz (Raoof and others 1999)")
    quality_exponent: float = Field(
        0.45, ge=0, le=1, description="of frequency in Q (Raoof and others 1999)"
    )
    kappa: float = Field(0.035, ge=0, le=1, description="s; generic rock (Boore & Joyner 1997)")
    stations: int = Field(24, ge=1, le=999, description="number of stations")
    city_latitude: Latitude = Field(0.0, description="centre of the stations, degrees north")
    city_longitude: Longitude = Field(0.3, description="centre of the stations, degrees east")
    city_radius: float = Field(12_000.0, gt=0, le=1e6, description="m")
    lakebed_latitude: Latitude = Field(0.0, description="centre of the lakebed, degrees north")
    lakebed_longitude: Longitude = Field(0.3, description="centre of the lakebed, degrees east")
    lakebed_radius: float = Field(6_000.0, ge=0, le=1e6, description="m; 0: no lakebed")
    lakebed_frequency: float = Field(
        0.5, gt=0, le=50, description="Hz, of the Kanai-Tajimi filter; Mexico City 0.4-0.6"
    )
    lakebed_damping: float = Field(
        0.1, gt=0, lt=1, description="of the Kanai-Tajimi filter, fraction of critical"
    )
    site_log_std: float = Field(
        0.7,
        ge=0,
        le=1.5,
        description="log-standard deviation of the Fourier spectrum between places",
    )
    noise: float = Field(2e-5, ge=0, le=1, description="m/s2, root mean square of the background")
    dt: float = Field(0.01, gt=0, le=0.05, description="sampling interval, s")

    @field_validator("origin_time")
    @classmethod
    def _a_time(cls, origin_time: str) -> str:
        datetime.fromisoformat(origin_time)
        return origin_time


class SimulatedPairs(Section):
    """A simulated inventory around the stations of a run."""

    count: int = Field(2000, ge=1, le=1_000_000_000, description="number of pairs")
    seed: int = Field(20, ge=0, le=2**63 - 1, description="seed of all random numbers")
    radius: float = Field(
        2000.0, gt=0, le=1e6, description="largest distance of a pair from its station, m"
    )
    touching: float = Field(
        0.5, ge=0, le=1, description="share of pairs without a gap, from 0 to 1"
    )


class Simulation(Section):
    """A simulated earthquake, its stations, and the pairs of buildings around them."""

    scenario: Scenario = Scenario()
    pairs: SimulatedPairs = SimulatedPairs()


#: Buildings of the longest row that may be configured: the cost of a row grows with its impacts.
MOST_BUILDINGS = 200


class Rows(Section):
    """Settings of joining pairs to rows of buildings (docs/rows.md)."""

    enabled: bool | None = Field(
        None,
        description=(
            "write rows.parquet and buildings.*; if not set: where the pair table has "
            "building_id_1 and building_id_2"
        ),
    )
    exact: bool | None = Field(
        None, description="exact history of every row of buildings; if not set: as screening.exact"
    )
    angle: float = Field(
        30.0,
        gt=0,
        lt=90,
        description="largest angle between the axes of two pairs of a row, degrees",
    )
    longest: int = Field(
        30,
        ge=3,
        le=MOST_BUILDINGS,
        description=(
            "largest number of buildings of a row; a longer one is cut at its widest gap, "
            "and flagged"
        ),
    )


class TableForm(Section):
    """Form of a table of pairs, where it cannot be recognised or is recognised wrongly."""

    encoding: str | None = Field(
        None, description="encoding of the text, such as cp1254 or cp932; recognised if not set"
    )
    separator: Literal[",", ";", "\t", "|"] | None = Field(
        None, description="character between the columns; recognised if not set"
    )
    decimal: Literal[".", ","] | None = Field(
        None, description="decimal mark of the numbers; recognised if not set"
    )
    sheet: str | None = Field(
        None, description="sheet of a workbook; if not set, the only one with a pair table"
    )
    columns: dict[str, str] = Field(
        {}, description='headings of the table: column of the schema = "heading in the table"'
    )
    units: dict[str, str] = Field(
        {},
        description=(
            'units of the table: column of the schema = "cm", "ft", ...; if not set, those '
            "of the schema"
        ),
    )


def box_of(text: str, box: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Return west, south, east and north, degrees; ``ValueError`` quotes the text of others."""
    if len(box) == 4:
        west, south, east, north = box
        # NaN is not within any limit
        if -180.0 <= west < east <= 180.0 and -90.0 <= south < north <= 90.0:
            return west, south, east, north
    raise ValueError(f"{text} is not W,S,E,N in degrees with W < E (not across 180) and S < N")


class Footprints(Section):
    """Outlines of buildings, of which neighbours are the pairs."""

    file: RelativePath = Field(
        description="layer of polygons: GeoPackage, GeoParquet, GeoJSON, Shapefile, FlatGeobuf"
    )
    distance: float = Field(3.0, ge=0.001, le=10.0, description="largest gap of a pair, m")
    layer: str | None = Field(None, description="name of the layer, for files that have several")
    gap_std: float | None = Field(
        None,
        ge=0,
        le=3,
        description=(
            "standard deviation of gaps, m; if not set, assumed by the origin of the outlines"
        ),
    )
    columns: dict[str, str] = Field(
        default_factory=dict,
        description=(
            'columns of the layer: quantity of a building = "column", such as height = "altura"'
        ),
    )
    bbox: tuple[Longitude, Latitude, Longitude, Latitude] | None = Field(
        None,
        description=(
            "box [W, S, E, N], degrees: only buildings that touch it, of GeoParquet with a column "
            "bbox"
        ),
    )
    heights: RelativePath | None = Field(
        None,
        description=(
            "GeoTIFF of heights above ground, m, for buildings without height, storeys and period; "
            "needs per_obspy[raster]"
        ),
    )

    @field_validator("bbox")
    @classmethod
    def _a_box(
        cls, bbox: tuple[float, float, float, float] | None
    ) -> tuple[float, float, float, float] | None:
        return bbox and box_of(str(list(bbox)), bbox)


class Pairs(TableForm):
    """Source of the building pairs: a table, footprints, stored inventories, or simulated pairs."""

    file: RelativePath | None = Field(None, description="pair table: CSV, Parquet or workbook")
    footprints: Footprints | None = Field(
        None, description="outlines of buildings, of which neighbours become the pairs"
    )
    catalog: RelativePath | None = Field(
        None, description="index of stored inventories, catalog.toml"
    )
    names: tuple[str, ...] = Field(
        (),
        description="names of stored inventories; if empty, all within the region of the stations",
    )
    simulated: SimulatedPairs | None = Field(
        None, description="simulated inventory around the stations"
    )
    largest_rejected_share: float = Field(
        0.5,
        ge=0,
        le=1,
        description="share of rejected rows above which a run warns, and stops with --strict",
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        # One source, whose other keys belong to it
        sources = (self.file, self.footprints, self.catalog, self.simulated)
        if sum(source is not None for source in sources) != 1:
            raise ValueError("give one of file, footprints, catalog and simulated")
        if self.names and self.catalog is None:
            raise ValueError("names are of stored inventories: give their catalog")
        given = [name for name in TableForm.model_fields if name in self.model_fields_set]
        if given and self.file is None:
            raise ValueError(f"{given[0]} is of a pair table: give its file")
        return self

    @property
    def form(self) -> TableForm:
        """The configured part of the form of the table."""
        return TableForm(**self.model_dump(include=set(TableForm.model_fields), exclude_unset=True))
