"""Largest relative displacements of 32 pairs of bilinear structures that never touch."""

from typing import Any

from per_obspy.kernels.pounding_lanes.lanes import APART
from per_obspy.kernels.pounding_lanes.lanes import (
    LANE_ROWS_WITHOUT_CONTACT as LANE_ROWS_WITHOUT_CONTACT,
)
from per_obspy.kernels.pounding_lanes.run_block import UNREACHABLE as UNREACHABLE
from per_obspy.kernels.pounding_lanes.run_block import run_block


def run_without_contact(*arguments: Any) -> bool:
    """
    Run 32 pairs that never touch through a record and the free vibration after it.

    The arguments are those of `run_block`, but ``lanes`` have LANE_ROWS_WITHOUT_CONTACT rows, and
    gaps are UNREACHABLE. The rows hold the results: OPENING, the largest ``u2 - u1`` in the first
    line and ``u1 - u2`` in the second (m), LARGEST_DISPLACEMENT (m) and LARGEST_RADIUS_SQUARED
    (m²). Return whether all pairs got through.
    """
    return run_block(*arguments, kind=APART)
