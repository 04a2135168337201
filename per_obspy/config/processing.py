"""Settings of the processing chain, and of the grid of the spectra."""

from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import Field, field_validator, model_validator

from per_obspy.config.section import Section
from per_obspy.constants import (
    LONGEST_STORED_PERIOD,
    SHORTEST_STORED_PERIOD,
    STORED_AZIMUTH_STEP,
    STORED_DAMPINGS,
    STORED_PERIODS,
)

#: One of two frequencies, Hz, which must rise above 0.
Frequency = Annotated[float, Field(le=1000)]


class Check(Section):
    """One check of a record: its limit, and the consequence of a failure."""

    threshold: float = Field(le=1e9, description="limit of the check, in its unit")
    level: str = Field(
        pattern="^(reject|warn|note)$",
        description=(
            "reject: the trace is left out; warn: somebody should look at the record, which is "
            "flagged; note: bookkeeping, in the column notes of stations.csv alone"
        ),
    )


def _check(threshold: float, level: str, description: str) -> Any:
    """Return the key of a check with its default limit and level."""
    return Field(Check(threshold=threshold, level=level), description=description)


class Checks(Section):
    """Thresholds of the record checks (``processing/account.py`` has their words)."""

    sampling_rate: Check = _check(20.0, "reject", "smallest sampling rate, Hz")
    sampling_interval: Check = _check(
        0.2,
        "reject",
        "longest sampling interval of any record, s: longer ones hold no strong motion",
    )
    channel_rate: Check = _check(
        0.01,
        "warn",
        "largest relative difference between the sampling rates of record and metadata",
    )
    duration: Check = _check(5.0, "reject", "shortest duration, s")
    levels: Check = _check(16, "reject", "smallest number of different values of the samples")
    clipped_run: Check = _check(
        5, "reject", "number of equal samples at an extreme from which a record is clipped"
    )
    pinned: Check = _check(
        3,
        "reject",
        "number of samples equal to an extreme, of a record that does not repeat other "
        "values, from which it is clipped",
    )
    saturation: Check = _check(
        2.0,
        "reject",
        "largest ratio of samples within 5 % of an extreme to those 5 to 15 % below it, at "
        "several flat excursions",
    )
    possible_saturation: Check = _check(
        1.0, "warn", "the same ratio, from which a record may be clipped"
    )
    wrapped: Check = _check(
        0.4,
        "reject",
        "smallest roughness that is left where steps across the range are turned back as "
        "overflows of the counter, relative to the roughness before",
    )
    counter_use: Check = _check(
        0.8, "note", "largest peak relative to the full scale of a 24-bit counter"
    )
    dropout: Check = _check(
        0.5, "reject", "duration without a change during the shaking that means missing samples, s"
    )
    filled: Check = _check(
        0.09,
        "reject",
        "longest time during the shaking whose samples are equal or on a straight line, as in"
        " a gap that was filled, if other such times are 4 times shorter, s",
    )
    spike: Check = _check(
        6.0, "reject", "largest ratio of the jump of one sample to the others within 0.5 s"
    )
    zero_crossings: Check = _check(0.1, "reject", "smallest number of zero crossings per second")
    header_peak: Check = _check(
        0.1, "warn", "largest relative difference between the peaks of header and samples"
    )
    header_rounding: Check = _check(
        0.01, "note", "the same difference, as rounding or another filter makes it"
    )
    outlier: Check = _check(
        5.0, "reject", "largest ratio of a peak to the largest peak of two other components"
    )
    weak_component: Check = _check(
        5.0,
        "reject",
        "largest ratio of the peaks of two horizontals (4 times as much to the vertical), "
        "from which the smaller one is left out",
    )
    copied_component: Check = _check(
        0.999,
        "reject",
        "largest correlation of two components: beyond it one is a copy of the other",
    )
    late_component: Check = _check(
        1.0, "reject", "largest time between the envelopes of two horizontals, s"
    )
    exchanged_component: Check = _check(
        0.4,
        "warn",
        "largest logarithm of the share of early motion (P waves) of a horizontal over that "
        "of the vertical and that of the other horizontal",
    )
    unusual_acceleration: Check = _check(
        43.0,
        "warn",
        "largest peak acceleration, m/s2: the largest one recorded is 42.8 (vector of three "
        "components, IWTH25, Iwate-Miyagi 2008)",
    )
    impossible_acceleration: Check = _check(
        86.0, "reject", "largest possible peak acceleration, m/s2: twice the largest one recorded"
    )
    unusual_velocity: Check = _check(
        3.2,
        "warn",
        "largest peak velocity, m/s: the largest one recorded is 3.18 (Chi-Chi 1999; Anderson"
        " 2010, BSSA 100, 1-36)",
    )
    impossible_velocity: Check = _check(
        6.4, "reject", "largest possible peak velocity, m/s: twice the largest one recorded"
    )
    weak_motion: Check = _check(
        1e-4,
        "warn",
        "smallest peak acceleration, m/s2: weaker motion is a tenth of what people feel, or "
        "in another unit",
    )
    velocity_time: Check = _check(
        3.0,
        "reject",
        "largest ratio of peak velocity to peak acceleration, s (below 1 s on the lake bed of"
        " Mexico City): beyond it the sampling interval is wrong",
    )
    late_trigger: Check = _check(
        0.1, "warn", "largest ratio of the motion of the first second to the peak"
    )
    cut_off: Check = _check(
        0.1, "warn", "largest ratio of the motion of the last second to the peak"
    )
    second_event: Check = _check(
        0.3, "warn", "largest ratio of a later peak after a quiet interval to the peak"
    )
    signal_to_noise: Check = _check(
        2.0, "reject", "smallest signal-to-noise ratio at the best frequency"
    )
    clear_band: Check = _check(2.0, "warn", "smallest signal-to-noise ratio over required_band")
    bandwidth: Check = _check(4.0, "reject", "smallest ratio of low-pass to high-pass corner")
    final_velocity: Check = _check(0.1, "reject", "largest ratio of the final velocity to its peak")
    final_displacement: Check = _check(
        0.2, "reject", "largest ratio of the final displacement to its peak"
    )
    baseline_shift: Check = _check(
        0.5, "warn", "largest ratio of the lasting velocity before the filter to the peak velocity"
    )


class Processing(Section):
    """Settings of the processing chain of a record (Boore 2005; gmprocess 2.8)."""

    highpass: float | None = Field(
        None, gt=0, le=100, description="high-pass corner, Hz; if not set, chosen for each record"
    )
    lowpass: float | None = Field(
        None,
        gt=0,
        le=1000,
        description=(
            "low-pass corner, Hz; if not set, chosen for each record; never above 0.75 of Nyquist"
        ),
    )
    order: int = Field(
        5, ge=1, le=20, description="order n of the Butterworth amplitude 1/sqrt(1 + (f_hp/f)^2n)"
    )
    taper: float = Field(
        0.05, ge=0, le=0.5, description="share of the record that is tapered at each end (Hann)"
    )
    usable: float = Field(
        0.8, gt=0, le=1, description="longest usable period times high-pass corner"
    )
    pre_event: float | None = Field(
        None,
        ge=0,
        le=86_400,
        description=(
            "length of the noise at the start of the record, s; if not set, until the first wave"
        ),
    )
    gain_tolerance: float = Field(
        0.1,
        gt=0,
        le=10,
        description="largest relative difference between product of stage gains and sensitivity",
    )
    overlap: float = Field(
        0.8, gt=0, le=1, description="share of the longer horizontal component that both must cover"
    )
    longest_noise: float = Field(
        120.0, gt=0, le=86_400, description="longest time before the first wave that is kept, s"
    )
    longest_signal: float = Field(
        600.0, gt=0, le=86_400, description="longest time after the first wave that is kept, s"
    )
    smoothing: float = Field(
        20.0, gt=0, le=1000, description="bandwidth b of the Konno-Ohmachi window"
    )
    required_band: tuple[Frequency, Frequency] = Field(
        (0.2, 10.0), description="frequencies between which the signal should exceed the noise, Hz"
    )
    highest_lowpass: float = Field(
        40.0,
        gt=0,
        le=1000,
        description="low-pass corner where the noise does not require a lower one, Hz",
    )
    highpass_range: tuple[Frequency, Frequency] = Field(
        (0.001, 0.5),
        description="lowest and highest high-pass corner, Hz; never below 1 / duration",
    )
    drift: float = Field(
        0.02,
        gt=0,
        lt=1,
        description=(
            "largest polynomial part of the displacement of a clean record, relative to its peak"
        ),
    )
    baseline_spread: float = Field(
        0.05,
        gt=0,
        le=10,
        description=(
            "largest deviation of ln PER between possible times of a baseline shift; usable "
            "periods end where it is exceeded"
        ),
    )
    fallback_highpass: dict[float, Annotated[float, Field(gt=0, le=100)]] = Field(
        {-10.0: 0.5, 3.5: 0.3, 5.5: 0.1},
        description=(
            "high-pass corner, Hz, of records without noise to measure, by smallest "
            "magnitude: magnitude = corner (gmprocess 2.8)"
        ),
    )
    unknown_highpass: float = Field(
        0.08,
        gt=0,
        le=100,
        description=(
            "high-pass corner of records without noise to measure and without a magnitude, Hz"
        ),
    )
    permanent_offset: bool = Field(
        False,
        description="keep the permanent displacement near a fault: no high-pass, adaptive baseline",
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
    """The grid of the stored spectra; pairs are computed at exact periods, not read off it."""

    dampings: tuple[Annotated[float, Field(ge=0, lt=1)], ...] = Field(
        STORED_DAMPINGS,
        min_length=1,
        description="dampings of the stored spectra, fractions of critical, ascending",
    )
    shortest: float = Field(
        SHORTEST_STORED_PERIOD,
        ge=0.001,
        le=100,
        description="shortest period of the stored spectra, s",
    )
    longest: float = Field(
        LONGEST_STORED_PERIOD, le=100.0, description="longest period of the stored spectra, s"
    )
    count: int = Field(
        STORED_PERIODS, ge=2, le=10_000, description="number of periods, logarithmically spaced"
    )
    azimuth_step: int = Field(
        STORED_AZIMUTH_STEP,
        ge=1,
        le=90,
        description="step between stored azimuths, degrees; RotD uses every degree",
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
