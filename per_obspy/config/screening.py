"""Assumptions about buildings, and settings of the motion, states and classes of pairs."""

from typing import Annotated, Literal, Self

from pydantic import (
    Field,
    field_validator,
    model_validator,
)

from per_obspy.config.section import Language, RelativePath, Section, SectionType
from per_obspy.constants import LANGUAGES

#: Largest offset of two floors that still hit floor to floor, m: 2 ft in FEMA P-154.
FLOOR_TOLERANCE = 0.61

#: States of a pair, likeliest first.
STATES = ("yes", "likely", "possible", "unlikely", "no")

#: State of a pair whose gap is unknown.
UNKNOWN_STATE = "unknown"

#: All states that a row can have.
EVERY_STATE = (*STATES, UNKNOWN_STATE)


class Building(Section):
    """Assumptions about buildings where the inventory has no value; each use is marked derived."""

    damping: float = Field(
        0.05,
        ge=0,
        lt=1,
        description="damping of buildings without a known one, fraction of critical",
    )
    damping_log_std: float = Field(
        0.3, ge=0, le=2, description="log-standard deviation of an assumed damping"
    )
    storey_height: float = Field(
        3.0, ge=2, le=12, description="height of a storey for heights derived from storeys, m"
    )
    storey_height_log_std: float = Field(
        0.13, ge=0, le=1, description="log-standard deviation of a height derived from storeys"
    )
    mass_per_area: float = Field(
        1000.0, ge=50, le=10_000, description="mass per floor and floor area, kg/m2"
    )
    area: float = Field(
        200.0,
        ge=1,
        le=1e6,
        description=(
            "floor area of buildings without a known one, m2; only the ratio of the masses matters"
        ),
    )
    restitution: float = Field(
        0.65,
        ge=0,
        le=1,
        description="coefficient of restitution of impacts between buildings; 0.65: concrete",
    )
    gap: float | None = Field(
        None,
        gt=0,
        le=10,
        description=(
            "median of unknown gaps, m; if not set, such pairs have a demand, but no probability"
        ),
    )
    gap_log_std: float = Field(
        1.0, gt=0, le=2, description="log-standard deviation of unknown gaps about their median"
    )
    floor_tolerance: float = Field(
        FLOOR_TOLERANCE,
        ge=0,
        le=12,
        description="largest difference of floor levels that count as aligned, m; 2 ft: FEMA P-154",
    )
    strength: Literal["none", "hazus"] = Field(
        "hazus",
        description=(
            "strength of buildings without a yield value: hazus (yield and ultimate capacity by "
            "system, storeys and code_level, where they are known) or none (they stay linear)"
        ),
    )
    code_level: Literal["low", "moderate", "high"] = Field(
        "moderate",
        description=(
            "HAZUS code level of the strength of buildings without a yield value: low, moderate "
            "or high"
        ),
    )
    period_formula: str = Field(
        "asce7",
        pattern="^(asce7|ec8)$",
        description=(
            "formula of periods derived from heights: asce7 or ec8; medians, not lower bounds"
        ),
    )


class Interpolation(Section):
    """Estimation of the motion between stations (``screening/motion_field.py``)."""

    log_std: float = Field(
        0.6,
        gt=0,
        le=3,
        description=(
            "assumed log-standard deviation of PER within an earthquake; published for SA: "
            "0.5 to 0.7"
        ),
    )
    log_std_weight: float = Field(
        5.0,
        gt=2,
        le=1e6,
        description=(
            "number of stations that log_std counts as; above 2, because Student's t "
            "distribution of the motion has no deviation below"
        ),
    )
    distance_slope: float = Field(
        -1.3,
        ge=-5,
        le=0,
        description=(
            "expected change of ln PER per ln of the distance to the hypocentre, corrected "
            "by the stations"
        ),
    )
    distance_slope_std: float = Field(
        0.5, gt=0, le=1e6, description="standard deviation of distance_slope between earthquakes"
    )
    demand_log_std: float = Field(
        0.55,
        ge=0,
        le=3,
        description=(
            "log-standard deviation of an exact demand about the demand expected from the "
            "motion between stations, far from the record of the pair (docs/calibration.md)"
        ),
    )
    demand_length: float = Field(
        4000.0,
        gt=0,
        le=20_000_000,
        description=(
            "distance from the record at which the correlation of the particular part of "
            "its demand has fallen to 1/e of the way from 1 to demand_persistence, m"
        ),
    )
    demand_persistence: float = Field(
        0.5,
        ge=0,
        le=1,
        description="correlation of the particular part of demands at places far apart",
    )
    vs30_clustered: bool = Field(
        False, description="Vs30 varies smoothly over the region (Jayaram & Baker, case 2)"
    )


#: Rules of codes, by the names that a configuration has for them.
CodeRule = Literal[
    "asce7-16",
    "ntc2004",
    "ntc2004-simplified",
    "gb50011-2010",
    "gem",
    "tbdy2018",
    "ntc2018-italy",
    "is1893-2016",
    "e030-2018",
    "iran2800",
    "rpa2024",
]


class Codes(Section):
    """Code rules (``screening/codes.py``) and their inputs; without its input a cell is empty."""

    rules: tuple[CodeRule, ...] = Field(
        (),
        description="code rules to compare gaps with, such as asce7-16 (docs/screening.md lists "
        "all); each adds a column",
    )
    ntc_zone: str | None = Field(
        None, pattern="^(I|II|III)$", description="zone of NTC Mexico City 2004: I, II or III"
    )
    gb_intensity: int | None = Field(
        None, ge=6, le=9, description="fortification intensity of GB 50011-2010"
    )
    italy_ground: float | None = Field(
        None, gt=0, le=2, description="a_g S of the life safety limit state of NTC Italy 2018, in g"
    )
    floor_tolerance: float = Field(
        FLOOR_TOLERANCE,
        ge=0,
        le=12,
        description=(
            "largest difference of floor levels that count as aligned in code rules, m; 2 "
            "ft: FEMA P-154"
        ),
    )

    @model_validator(mode="after")
    def _known_inputs(self) -> Self:
        if "gb50011-2010" in self.rules and self.gb_intensity is None:
            raise ValueError("the rule gb50011-2010 needs gb_intensity, 6 to 9")
        return self


class States(Section):
    """Smallest probability of contact of each state; a pair below all of them is a ``no``."""

    yes: float = Field(0.9, gt=0, le=1, description="probability from which contact is a yes")
    likely: float = Field(0.5, gt=0, le=1, description="probability from which contact is likely")
    possible: float = Field(
        0.1, gt=0, le=1, description="probability from which contact is possible"
    )
    unlikely: float = Field(
        0.01, gt=0, le=1, description="probability from which contact is unlikely, below it no"
    )

    @model_validator(mode="after")
    def _descending(self) -> Self:
        thresholds = [self.yes, self.likely, self.possible, self.unlikely]
        if thresholds != sorted(set(thresholds), reverse=True):
            raise ValueError(
                f"yes > likely > possible > unlikely is required, got {self.yes:g}, "
                f"{self.likely:g}, {self.possible:g}, {self.unlikely:g}"
            )
        return self


class Screening(Section):
    """Ground motion of pairs, and thresholds of states and classes."""

    largest_distance: float = Field(
        20_000.0,
        gt=0,
        le=20_000_000,
        description="largest distance from station to pair, m; pairs beyond are rejected",
    )
    flag_distance: float = Field(
        5_000.0,
        gt=0,
        le=20_000_000,
        description="distance from station to pair beyond which it is flagged, m",
    )
    exact: bool = Field(
        True, description="exact demand and history of every pair; false: estimates only, faster"
    )
    states: States = States()
    per_to_sd: float = Field(
        1.5,
        ge=1,
        le=1000,
        description="ratio PER/SD above which a gap from PER is flagged as far too large",
    )
    classes: dict[str, Annotated[float, Field(ge=0, le=100, allow_inf_nan=False)]] = Field(
        {"severe": 0.5, "high": 0.2, "moderate": 0.05, "low": 0.0},
        description=(
            "smallest expected impact velocity of each risk class, m/s, in descending order "
            "to 0: class = velocity; thresholds of this package, not verified "
            "(docs/screening.md)"
        ),
    )
    linearized_median: float = Field(
        2.7,
        gt=0,
        le=100,
        description=(
            "median of the ratio of the linearized critical gap of yielding pairs to the "
            "exact one, where the linearized gap decides"
        ),
    )
    linearized_dispersion: float = Field(
        0.65,
        ge=0,
        le=3,
        description=(
            "log-standard deviation of the ratio of the linearized critical gap of yielding "
            "pairs to the exact one"
        ),
    )
    target_amplification: float = Field(
        1.25,
        ge=1,
        le=100,
        description="largest ratio of PER after to PER before an impact that a bumper may allow",
    )
    shakemap_log_std: float = Field(
        0.6,
        gt=0,
        le=3,
        description="assumed log-standard deviation of a ShakeMap without uncertainty",
    )
    interpolation: Interpolation = Field(
        Interpolation(), description="settings of the motion between stations"
    )
    codes: Codes = Field(Codes(), description="code rules and their inputs")

    @field_validator("classes")
    @classmethod
    def _descending(cls, classes: dict[str, float]) -> dict[str, float]:
        thresholds = list(classes.values())
        if not thresholds or thresholds != sorted(set(thresholds), reverse=True):
            raise ValueError(f"thresholds (m/s) must be in descending order, got {classes}")
        if thresholds[-1] != 0.0:
            raise ValueError(f"the last threshold must be 0 m/s, got {classes}")
        return classes


class ReportTexts(Section):
    """The page ``report.html`` and the summaries."""

    language: Language = Field("en", description=f"of page and summaries: {' or '.join(LANGUAGES)}")
    revision: int = Field(
        0,
        ge=0,
        le=1_000_000,
        description="revision on page and summary; 0: the number that watch gives, if any",
    )
    background: RelativePath | None = Field(
        None,
        description="file of lines behind the map of the page, such as streets: vector tiles "
        "(.pmtiles, .mbtiles), or a layer as footprints have it; needs per_obspy[gis]",
    )
    background_layers: tuple[str, ...] = Field(
        (),
        description="its layers; none: all lines of vector tiles, or else their outlines, and the "
        "only layer of other files",
    )


def in_language(settings: SectionType, language: str | None) -> SectionType:
    """Return settings with another language of page and summaries, if one is given."""
    if language is None:
        return settings
    report: ReportTexts = getattr(settings, "report")  # noqa: B009 - of every screening
    return settings.model_copy(update={"report": report.model_copy(update={"language": language})})


class Totals(Section):
    """Areas by which pairs are counted: one of these settings decides."""

    cell: float = Field(1000.0, ge=1, le=10_000_000, description="size of the cells of a grid, m")
    area: str | None = Field(
        None, description="column of the pair table that names the area, instead of cells"
    )
    h3: int | None = Field(
        None,
        ge=0,
        le=15,
        description="resolution of H3 hexagons, instead of cells; needs per_obspy[gis]",
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if len(given := self.model_fields_set & {"cell", "area", "h3"}) > 1:
            raise ValueError(f"give one of cell, area and h3, got {', '.join(sorted(given))}")
        return self
