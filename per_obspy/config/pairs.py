"""Where the building pairs of a run come from, and how their table is written."""

from typing import Literal, Self

from pydantic import Field, model_validator

from per_obspy.config.section import RelativePath, Section
from per_obspy.config.simulation import SimulatedPairs


class TableForm(Section):
    """How a table of pairs is written, where that cannot be recognised or is to be another."""

    encoding: str | None = Field(
        None, description="of its text, such as cp1254 or cp932; recognised if not given"
    )
    separator: Literal[",", ";", "\t", "|"] | None = Field(
        None, description="sign between its columns; recognised if not given"
    )
    decimal: Literal[".", ","] | None = Field(
        None, description="decimal mark of its numbers; recognised if not given"
    )
    sheet: str | None = Field(
        None, description="sheet of a workbook; the only one with a pair table if not given"
    )
    columns: dict[str, str] = Field(
        {}, description='names: column of the schema = "heading in the table"'
    )
    units: dict[str, str] = Field(
        {}, description='units: column of the schema = "cm", "ft", ...; those of the schema if none'
    )


class Footprints(Section):
    """Outlines of buildings, of which neighbours are the pairs."""

    file: RelativePath = Field(
        description="layer of polygons: GeoPackage, GeoParquet, GeoJSON, Shapefile, FlatGeobuf"
    )
    distance: float = Field(3.0, ge=0.001, le=10.0, description="m, largest gap of a pair")
    layer: str | None = Field(None, description="name of the layer, for files that have several")
    gap_std: float | None = Field(
        None,
        ge=0,
        le=1,
        description="m, standard deviation of drawn gaps; not given: assumed and marked",
    )
    columns: dict[str, str] = Field(
        default_factory=dict,
        description='quantity of a building -> column of the layer, such as { height = "altura" }',
    )


class Pairs(TableForm):
    """Source of the building pairs: a table, footprints, stored inventories, or simulated pairs."""

    file: RelativePath | None = Field(None, description="pair table: CSV, Parquet or workbook")
    footprints: Footprints | None = Field(
        None, description="outlines of buildings; their pairs are found first"
    )
    catalog: RelativePath | None = Field(
        None, description="index of stored inventories, catalog.toml"
    )
    names: tuple[str, ...] = Field(
        (), description="of stored inventories; none: all that the stations' region touches"
    )
    simulated: SimulatedPairs | None = Field(
        None, description="simulated inventory around the stations"
    )
    largest_rejected_share: float = Field(
        0.5, ge=0, le=1, description="share of rejected rows above which a run warns; see --strict"
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
        """What is given of the form of the table."""
        return TableForm(**self.model_dump(include=set(TableForm.model_fields), exclude_unset=True))
