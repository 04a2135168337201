"""Settings of a run, of a design spectrum and of an ensemble, and the kind of a TOML file."""

from collections import Counter
from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from per_obspy.config.engine import Engine
from per_obspy.config.pairs import Pairs, Rows
from per_obspy.config.processing import Processing, Spectra
from per_obspy.config.records import Records
from per_obspy.config.screening import Building, ReportTexts, Screening, Totals
from per_obspy.config.section import RelativePath, Section, read_toml
from per_obspy.config.watch import Notify, Watch
from per_obspy.constants import REFERENCE_DAMPING
from per_obspy.errors import CatalogError


class Run(Section):
    """Configuration of one run."""

    name: str = Field(min_length=1, description="title of tables and figures")
    output: RelativePath = Field(description="folder of the results")
    workers: int = Field(0, ge=0, le=1024, description="number of processes; 0: one per processor")
    simulation: RelativePath | None = Field(
        None, description="TOML file of an event to simulate instead of records"
    )
    records: Records | None = Field(None, description="sources of the records")
    pairs: Pairs | None = Field(None, description="source of the pairs, if not the simulation")
    after: RelativePath | None = Field(
        None,
        description="results of an earlier earthquake on the same pairs, from which the gaps start "
        "that its histories left; pairs whose damage nobody knows are never no",
    )
    processing: Processing = Processing()
    spectra: Spectra = Spectra()
    building: Building = Building()
    screening: Screening = Screening()
    totals: Totals = Totals()
    report: ReportTexts = ReportTexts()
    rows: Rows = Rows()
    notify: Notify = Notify()
    engine: Engine = Engine()
    watch: Watch | None = Field(None, description="earthquakes that `per-obspy watch` looks for")
    csv_rows: int = Field(
        100_000,
        ge=1,
        le=1_000_000_000,
        description="largest number of rows in risk.csv, the worst ones; the Parquet file has all",
    )
    dataset_from: int = Field(
        20_000_000,
        ge=1,
        le=1_000_000_000_000,
        description="number of pairs from which the ranked table is a folder risk/ with one "
        "Parquet file per cell, instead of one file risk.parquet",
    )
    dataset_cell: float = Field(
        1.0, ge=0.1, le=90.0, description="width and height of a cell of the folder risk/, degrees"
    )
    geopackage: bool = Field(
        False, description="write risk.gpkg, risk.qgz and GeoParquet; needs per_obspy[gis]"
    )
    pmtiles: bool = Field(
        False,
        description="write risk_pairs.pmtiles and risk_buildings.pmtiles too, vector tiles for "
        "maps on the web; needs geopackage = true",
    )
    spreadsheet: bool = Field(
        False, description="write risk.xlsx too; needs per_obspy[spreadsheet]"
    )

    @model_validator(mode="after")
    def _tiles_of_layers(self) -> Self:
        if self.pmtiles and not self.geopackage:
            raise ValueError("pmtiles needs geopackage = true: tiles are made of its layers")
        return self

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.simulation is None) == (self.records is None):
            raise ValueError("give either simulation or records")
        if self.records is not None and self.pairs is None:
            raise ValueError("give pairs: a file, or how to simulate them")
        fdsn = self.records.fdsn if self.records else None
        if fdsn and fdsn.shakemap and not fdsn.event_id and self.watch is None:
            raise ValueError("records.fdsn.shakemap needs records.fdsn.event_id")
        return self

    @model_validator(mode="after")
    def _known_classes(self) -> Self:
        for number, group in enumerate(self.notify.groups):
            if group.least_class not in self.screening.classes:
                classes = ", ".join(self.screening.classes)
                key = f"notify.groups.{number}.least_class"
                raise ValueError(f"{key}: {group.least_class!r} is none of {classes}")
        return self

    @model_validator(mode="after")
    def _comparable_stations(self) -> Self:
        dampings = self.spectra.dampings
        if not dampings[0] <= REFERENCE_DAMPING <= dampings[-1]:
            given = ", ".join(f"{damping:g}" for damping in dampings)
            raise ValueError(
                f"spectra.dampings must reach from 0.05 or below to 0.05 or above, got {given}: "
                f"stations are "
                "compared at 5 %"
            )
        return self


#: Once in 475 years, or by 10 % in 50 years.
TARGET_RATE = 1.0 / 475.0


class Design(Section):
    """A screening by a design or user spectrum instead of records."""

    spectrum: RelativePath = Field(
        description=(
            "CSV: period (s), damping, and sd (m) or psa (m/s2); or a hazard of OpenQuake: uniform "
            "hazard spectra, a hazard curve, or a folder of hazard curves of several SA"
        )
    )
    shape: RelativePath | None = Field(
        None,
        description="design spectrum whose shape a hazard curve of PGA or of one SA scales",
    )
    target_rate: float = Field(
        TARGET_RATE,
        gt=0,
        le=1,
        description="annual rate of contact that is accepted, 1/year; of a seismic hazard",
    )
    pairs: RelativePath = Field(description="pair table, CSV or Parquet")
    output: RelativePath = Field(description="folder of the results")
    building: Building = Building()
    screening: Screening = Screening()
    totals: Totals = Totals()
    report: ReportTexts = ReportTexts()
    geopackage: bool = Field(
        False, description="write design.gpkg, design.qgz and GeoParquet; needs per_obspy[gis]"
    )
    spreadsheet: bool = Field(
        False, description="write design.xlsx too; needs per_obspy[spreadsheet]"
    )


class EnsembleScenario(Section):
    """One earthquake that may happen."""

    name: str = Field(
        min_length=1, description="name of the scenario, unique; part of the name of its column"
    )
    run: RelativePath = Field(description="TOML file of its run")
    weight: float | None = Field(
        None, ge=0, le=1e9, description="probability of the scenario relative to the others"
    )
    rate: float | None = Field(None, ge=0, le=1e6, description="how often it happens, 1/year")


class Ensemble(Section):
    """Scenarios with weights, or with annual rates; all of them screen the same inventory."""

    name: str = Field(min_length=1, description="title")
    output: RelativePath = Field(description="folder of the results; every run keeps its own")
    scenario: tuple[EnsembleScenario, ...] = Field(min_length=1)
    target_rate: float = Field(
        TARGET_RATE,
        gt=0,
        le=1,
        description="annual rate of contact that is accepted, 1/year, below the sum of the rates; "
        "of scenarios with rates",
    )
    report: ReportTexts = ReportTexts()
    csv_rows: int = Field(
        100_000,
        ge=1,
        le=1_000_000_000,
        description="largest number of rows in ensemble.csv, the worst",
    )
    geopackage: bool = Field(
        False, description="write ensemble.gpkg, ensemble.qgz and GeoParquet; needs per_obspy[gis]"
    )
    spreadsheet: bool = Field(
        False, description="write ensemble.xlsx too; needs per_obspy[spreadsheet]"
    )

    @property
    def yearly(self) -> bool:
        """Whether the scenarios have rates."""
        return self.scenario[0].rate is not None

    @property
    def weights(self) -> dict[str, float]:
        """Weight of each scenario, or its rate (1/year)."""
        return {
            scenario.name: scenario.rate if scenario.rate is not None else scenario.weight or 0.0
            for scenario in self.scenario
        }

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        names = [scenario.name for scenario in self.scenario]
        counts = Counter(name.lower() for name in names)
        if repeated := [name for name in names if counts[name.lower()] > 1]:
            raise ValueError(f"name: {repeated[-1]!r} occurs twice (capitals do not count)")
        return self

    @model_validator(mode="after")
    def _weights_or_rates(self) -> Self:
        for scenario in self.scenario:
            # One of the two, and the same one for all scenarios
            if (scenario.weight is None) == (scenario.rate is None):
                raise ValueError(f"{scenario.name!r} needs either a weight or a rate")
            if (scenario.rate is None) == self.yearly:
                raise ValueError(
                    f"{scenario.name!r} has a {'weight' if self.yearly else 'rate'}, others have "
                    f"the other one"
                )
        if not sum(self.weights.values()) > 0.0:
            raise ValueError("weights or rates must have a positive sum, all are 0")
        if self.yearly and not self.target_rate < sum(self.weights.values()):
            raise ValueError(
                f"target_rate = {self.target_rate:g} is not below the sum of the rates, "
                f"{sum(self.weights.values()):g} 1/year: without more frequent scenarios no gap "
                "would be asked for"
            )
        if not self.yearly and "target_rate" in self.model_fields_set:
            raise ValueError("target_rate needs scenarios with rates, these have weights")
        return self


def screening_kind(path: Path) -> type[Run] | type[Design] | type[Ensemble]:
    """
    Return the kind of screening of a TOML file, by the key that other kinds do not have.

    Raises
    ------
    CatalogError
        If the file cannot be read or is none of them.
    """
    content = read_toml(path)
    if isinstance(content.get("spectrum"), str):
        return Design
    if isinstance(content.get("scenario"), list):
        return Ensemble
    if content.keys() & {"records", "simulation"}:
        return Run
    raise CatalogError(
        str(path),
        "no ground motion to screen by: give records or simulation (a run), spectrum (a design "
        "spectrum) or [[scenario]] "
        "(an ensemble)",
    )
