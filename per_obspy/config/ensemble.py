"""Several scenarios, each a run of its own, screened together."""

from typing import Self

from pydantic import Field, model_validator

from per_obspy.config.section import RelativePath, Section


class EnsembleScenario(Section):
    """One earthquake that may happen."""

    name: str = Field(min_length=1, description="unique; stands in the name of its column")
    run: RelativePath = Field(description="TOML file of its run")
    weight: float | None = Field(None, ge=0, description="how likely it is beside the others")
    rate: float | None = Field(None, ge=0, description="how often it happens, 1/year")


class Ensemble(Section):
    """Scenarios with weights, or with annual rates; all of them screen the same inventory."""

    name: str = Field(min_length=1, description="title")
    output: RelativePath = Field(description="folder of the results; every run keeps its own")
    scenario: tuple[EnsembleScenario, ...] = Field(min_length=1)
    csv_rows: int = Field(
        100_000, ge=1, description="largest number of rows in ensemble.csv, the worst"
    )

    @property
    def yearly(self) -> bool:
        """Whether the scenarios have rates."""
        return self.scenario[0].rate is not None

    @property
    def weights(self) -> dict[str, float]:
        """Weight of each scenario, or its rate (1/year)."""
        return {
            one.name: one.rate if one.rate is not None else one.weight or 0.0
            for one in self.scenario
        }

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        names = [one.name.lower() for one in self.scenario]
        if twice := [one.name for one in self.scenario if names.count(one.name.lower()) > 1]:
            raise ValueError(f"name: {twice[-1]!r} stands twice (capitals do not count)")
        return self

    @model_validator(mode="after")
    def _weights_or_rates(self) -> Self:
        for one in self.scenario:
            if (one.weight is None) == (one.rate is None):
                raise ValueError(f"{one.name!r} needs either a weight or a rate")
            if (one.rate is None) == self.yearly:
                raise ValueError(
                    f"{one.name!r} has a {'weight' if self.yearly else 'rate'}, others have the other one"
                )
        if not sum(self.weights.values()) > 0.0:
            raise ValueError("weights or rates must have a positive sum, all are 0")
        return self
