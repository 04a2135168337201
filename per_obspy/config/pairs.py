"""Settings of the building pairs of a run: their source, and the form of their table."""

from typing import Literal, Self

from pydantic import Field, model_validator

from per_obspy.config.section import RelativePath, Section
from per_obspy.config.simulation import SimulatedPairs


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
        le=1,
        description="standard deviation of drawn gaps, m; if not set, assumed and marked so",
    )
    columns: dict[str, str] = Field(
        default_factory=dict,
        description=(
            'columns of the layer: quantity of a building = "column", such as height = "altura"'
        ),
    )


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
