"""How rows of neighbouring buildings are found and followed."""

from pydantic import Field

from per_obspy.config.section import Section

#: Buildings of the longest row that may be configured: the cost of a row grows with its impacts.
MOST_BUILDINGS = 200


class Rows(Section):
    """How pairs join to rows of buildings (docs/rows.md)."""

    enabled: bool | None = Field(
        None,
        description="write rows.parquet and buildings.*; not given: where the pair table has "
        "building_id_1 and building_id_2",
    )
    exact: bool | None = Field(
        None, description="exact history of every row; not given: as screening.exact"
    )
    angle: float = Field(
        30.0, gt=0, lt=90, description="degrees, largest between the axes of two pairs of a row"
    )
    longest: int = Field(
        30,
        ge=3,
        le=MOST_BUILDINGS,
        description="buildings; a longer row is cut at its widest gap, and flagged",
    )
