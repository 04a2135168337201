"""
Heights of buildings that have none, from buildings of the same class in the same layer.

The estimate is the median of the class, and its deviation is that of the class:
``height_log_std``. A class needs ``ENOUGH`` known heights; where there are none but storeys, the
same is done with storeys. No value is taken from outside the layer. The known buildings are taken
for a sample of the class, which they may not be: tall buildings are mapped first.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

#: Known values that a class needs. The median of twenty of log-deviation s is off by 1.25 s / 4.5.
ENOUGH = 20

#: Column of the deviation.
LOG_STD = "height_log_std"


class _Spread(NamedTuple):
    """Median and logarithmic standard deviation of each row's class, NaN if too few are known."""

    median: pd.Series
    log_std: pd.Series


def with_class_heights(
    table: pd.DataFrame, classes: pd.Series, is_understood: NDArray[np.bool_] | bool = True
) -> pd.DataFrame:
    """
    Return a table of buildings with missing heights or storeys estimated by class.

    Parameters
    ----------
    table : DataFrame
        With ``height``, ``storeys`` or ``period``.
    classes : Series
        Class of each building; missing classes form a separate class.
    is_understood : (n,) ndarray of bool, optional
        Whether every size of the row was understood; others are not estimated.

    Returns
    -------
    table : DataFrame
        Estimated rows have ``height_log_std``, the logarithmic standard deviation of the class, at
        least 1e-3, by which the row is marked as derived.
    """
    sizes = [name for name in ("height", "storeys", "period") if name in table]
    missing = table[sizes].isna().all(axis=1) & is_understood
    if not missing.any():
        return table
    # Classes as text
    labels = classes.fillna("").astype(str)
    result = table.copy()
    # Heights first, storeys where a class has too few heights
    for name in ("height", "storeys"):
        if name not in table:
            continue
        spread = _spread(table[name], labels)
        rows = missing & spread.median.notna()
        result[name] = result[name].mask(rows, spread.median)
        given = result[LOG_STD] if LOG_STD in result else pd.Series(np.nan, table.index)
        result[LOG_STD] = given.mask(rows, spread.log_std.clip(lower=1e-3))
        missing &= ~rows
    return result


def _spread(values: pd.Series, labels: pd.Series) -> _Spread:
    """Return the spread of known positive values by class."""
    logarithms = np.log(values.where(values > 0.0))
    grouped = logarithms.groupby(labels)
    is_enough = grouped.transform("count") >= ENOUGH
    median = np.exp(grouped.transform("median")).where(is_enough)
    return _Spread(median, grouped.transform("std").where(is_enough))
