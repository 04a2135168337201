"""Several scenarios, each a run of its own, screened together."""

from collections import Counter
from typing import Self

from pydantic import Field, model_validator

from per_obspy.config.screening import ReportTexts
from per_obspy.config.section import RelativePath, Section


class EnsembleScenario(Section):
    """One earthquake that may happen."""

    name: str = Field(
        min_length=1, description="name of the scenario, unique; part of the name of its column"
    )
    run: RelativePath = Field(description="TOML file of its run")
    weight: float | None = Field(
        None, ge=0, description="probability of the scenario relative to the others"
    )
    rate: float | None = Field(None, ge=0, description="how often it happens, 1/year")


class Ensemble(Section):
    """Scenarios with weights, or with annual rates; all of them screen the same inventory."""

    name: str = Field(min_length=1, description="title")
    output: RelativePath = Field(description="folder of the results; every run keeps its own")
    scenario: tuple[EnsembleScenario, ...] = Field(min_length=1)
    report: ReportTexts = ReportTexts()
    csv_rows: int = Field(
        100_000, ge=1, description="largest number of rows in ensemble.csv, the worst"
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
        return self
