"""Functions of this room as plugins of ObsPy: ``trace.filter`` and ``trace.detrend``."""

from per_obspy.processing.filter.baseline import (
    boore_segments,
    displacement_polynomial,
    velocity_residual,
)
from per_obspy.processing.filter.butterworth import acausal_butterworth

__all__ = ["acausal_butterworth", "boore_segments", "displacement_polynomial", "velocity_residual"]
