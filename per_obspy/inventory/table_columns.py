"""Columns of a pair table, whether the table has them or not."""

import numpy as np
import pandas as pd

from per_obspy.checks import FloatArray


def numbers_in(pairs: pd.DataFrame, name: str) -> FloatArray:
    """Return a column of numbers, NaN where the table is silent."""
    return (
        pairs[name].to_numpy(dtype=np.float64)
        if name in pairs.columns
        else np.full(len(pairs), np.nan)
    )
