"""Settings of the processing chain, and of the grid of the spectra."""

from itertools import pairwise
from typing import Annotated, Self

from pydantic import (
    Field,
    field_validator,
    model_validator,
)

from per_obspy.config.section import Section
from per_obspy.constants import (
    LONGEST_STORED_PERIOD,
    SHORTEST_STORED_PERIOD,
    STORED_AZIMUTH_STEP,
    STORED_DAMPINGS,
    STORED_PERIODS,
)


class Check(Section):
    """One check of a record: where it fails, and what a failure means."""

    threshold: float = Field(description="in the unit that the check names")
    level: str = Field(
        pattern="^(reject|warn|note)$",
        description="reject leaves the trace out; warn, note: recorded",
    )


class Checks(Section):
    """Thresholds of the record checks (``processing/quality``, ``processing/filter/corners``)."""

    sampling_rate: Check = Field(Check(threshold=20.0, level="reject"), description="Hz, at least")
    duration: Check = Field(Check(threshold=5.0, level="reject"), description="s, at least")
    levels: Check = Field(
        Check(threshold=16, level="reject"),
        description="different values a sample takes, at least",
    )
    clipped_run: Check = Field(
        Check(threshold=5, level="reject"),
        description="equal samples at an extreme, fewer than",
    )
    counter_use: Check = Field(
        Check(threshold=0.8, level="warn"),
        description="peak over full scale of a 24-bit counter, at most",
    )
    dropout: Check = Field(
        Check(threshold=0.5, level="reject"),
        description="s without change during the shaking, less than",
    )
    spike: Check = Field(
        Check(threshold=6.0, level="reject"),
        description="jump of one sample over others within 0.5 s, at most",
    )
    zero_crossings: Check = Field(
        Check(threshold=0.1, level="reject"),
        description="zero crossings per second, at least",
    )
    header_peak: Check = Field(
        Check(threshold=0.01, level="warn"),
        description="peak, relative difference between header and samples, at most",
    )
    outlier: Check = Field(
        Check(threshold=5.0, level="reject"),
        description="peak over the largest peak of two sisters, at most",
    )
    late_trigger: Check = Field(
        Check(threshold=0.1, level="warn"),
        description="motion of the first second over the peak, at most",
    )
    cut_off: Check = Field(
        Check(threshold=0.1, level="warn"),
        description="motion of the last second over the peak, at most",
    )
    second_event: Check = Field(
        Check(threshold=0.3, level="warn"),
        description="later peak after quiet over the peak, at most",
    )
    signal_to_noise: Check = Field(
        Check(threshold=2.0, level="reject"),
        description="signal to noise at the best frequency, at least",
    )
    clear_band: Check = Field(
        Check(threshold=2.0, level="warn"),
        description="signal to noise over required_band, at least",
    )
    bandwidth: Check = Field(
        Check(threshold=4.0, level="reject"),
        description="low-pass over high-pass corner, at least",
    )
    final_velocity: Check = Field(
        Check(threshold=0.1, level="reject"),
        description="final velocity over its peak, at most",
    )
    final_displacement: Check = Field(
        Check(threshold=0.2, level="reject"),
        description="final displacement over its peak, at most",
    )
    baseline_shift: Check = Field(
        Check(threshold=0.5, level="warn"),
        description="velocity before the filter that stays, over the peak",
    )


class Processing(Section):
    """Settings of the processing chain of a record (Boore 2005; gmprocess 2.8)."""

    highpass: float | None = Field(
        None, gt=0, description="corner, Hz; not given: found for each record"
    )
    lowpass: float | None = Field(
        None, gt=0, description="corner, Hz; not given: found; never above 0.75 of Nyquist"
    )
    order: int = Field(
        5, ge=1, le=20, description="n of the Butterworth amplitude 1/sqrt(1+(f_hp/f)^2n)"
    )
    taper: float = Field(0.05, ge=0, le=0.5, description="fraction of the record at each end, Hann")
    usable: float = Field(0.8, gt=0, le=1, description="longest usable period = usable / f_hp")
    pre_event: float | None = Field(
        None, ge=0, description="s of noise at the start; not given: until the first wave"
    )
    gain_tolerance: float = Field(
        0.1, gt=0, description="between product of stage gains and sensitivity, relative"
    )
    overlap: float = Field(
        0.8, gt=0, le=1, description="part of the longer horizontal that both must cover"
    )
    onset_margin: float = Field(
        0.5, ge=0, description="s before the first wave where the noise ends"
    )
    shortest_noise: float = Field(
        2.0, gt=0, description="s of noise that tell something; fewer count as none"
    )
    longest_noise: float = Field(120.0, gt=0, description="s before the first wave that are kept")
    longest_signal: float = Field(600.0, gt=0, description="s after the first wave that are kept")
    pick_tolerance: float = Field(
        10.0, gt=0, description="s between a pick and the computed travel time of P"
    )
    smoothing: float = Field(20.0, gt=0, description="b of the Konno-Ohmachi window")
    required_band: tuple[float, float] = Field(
        (0.2, 10.0), description="Hz, where the signal should clear the noise"
    )
    highest_lowpass: float = Field(
        40.0, gt=0, description="Hz, where the noise does not ask for less"
    )
    highpass_range: tuple[float, float] = Field(
        (0.001, 0.5), description="Hz; never below 1 / duration"
    )
    drift: float = Field(
        0.02, gt=0, lt=1, description="polynomial part of the displacement that counts as clean"
    )
    baseline_spread: float = Field(
        0.05,
        gt=0,
        description=(
            "usable periods end where ln PER varies more between the times at which the baseline "
            "may have shifted"
        ),
    )
    fallback_highpass: dict[float, Annotated[float, Field(gt=0)]] = Field(
        {-10.0: 0.5, 3.5: 0.3, 5.5: 0.1},
        description=(
            "without noise to measure: magnitude from which on -> corner, Hz (gmprocess 2.8)"
        ),
    )
    unknown_highpass: float = Field(
        0.08, gt=0, description="Hz, without noise to measure and without magnitude"
    )
    permanent_offset: bool = Field(
        False, description="near a fault: keep it, no high-pass, adaptive baseline"
    )
    checks: Checks = Field(Checks(), description="thresholds of the record checks")

    @field_validator("required_band", "highpass_range")
    @classmethod
    def _rising(cls, band: tuple[float, float]) -> tuple[float, float]:
        if not 0.0 < band[0] < band[1]:
            raise ValueError(
                f"must be two rising frequencies above 0, got {band[0]:g} and {band[1]:g} Hz"
            )
        return band

    @model_validator(mode="after")
    def _a_band(self) -> Self:
        if self.highpass is not None and self.lowpass is not None and self.highpass >= self.lowpass:
            raise ValueError(
                f"highpass = {self.highpass:g} Hz must be below lowpass = {self.lowpass:g} Hz"
            )
        return self

    @model_validator(mode="after")
    def _one_long_period_limit(self) -> Self:
        if self.permanent_offset and self.highpass is not None:
            raise ValueError(
                f"permanent_offset keeps what highpass = {self.highpass:g} Hz removes: give "
                f"one of them"
            )
        return self


class Spectra(Section):
    """The grid of the stored spectra; pairs are computed at their own periods, not read off it."""

    dampings: tuple[Annotated[float, Field(ge=0, lt=1)], ...] = Field(
        STORED_DAMPINGS, min_length=1, description="fractions of critical, rising"
    )
    shortest: float = Field(SHORTEST_STORED_PERIOD, ge=0.001, description="s")
    longest: float = Field(LONGEST_STORED_PERIOD, le=100.0, description="s")
    count: int = Field(
        STORED_PERIODS, ge=2, le=10_000, description="periods, logarithmically spaced"
    )
    azimuth_step: int = Field(
        STORED_AZIMUTH_STEP,
        ge=1,
        le=90,
        description="degrees between stored azimuths; RotD uses every degree",
    )

    @field_validator("dampings")
    @classmethod
    def _rising(cls, dampings: tuple[float, ...]) -> tuple[float, ...]:
        if any(later <= earlier for earlier, later in pairwise(dampings)):
            raise ValueError(f"must rise, got {', '.join(f'{one:g}' for one in dampings)}")
        return dampings

    @field_validator("azimuth_step")
    @classmethod
    def _even(cls, step: int) -> int:
        if 180 % step:
            raise ValueError(f"must divide 180 degrees into equal parts, got {step}")
        return step

    @model_validator(mode="after")
    def _a_range(self) -> Self:
        if self.shortest >= self.longest:
            raise ValueError(
                f"shortest = {self.shortest:g} s must be below longest = {self.longest:g} s"
            )
        return self
