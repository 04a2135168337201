"""Settings of rows of neighbouring buildings."""

from pydantic import Field

from per_obspy.config.section import Section

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
