"""Which of many properties a row has, as one text."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray


def joined_names(rows: Mapping[str, NDArray[np.bool_]]) -> NDArray[np.object_]:
    """
    Return the names of what is true of each row, separated by a blank; empty where nothing is.

    Rows share few combinations, so that each is written once.

    Parameters
    ----------
    rows : mapping of str to (n,) ndarray of bool
        At least one and at most 63 names, in the order in which they are written.

    Examples
    --------
    >>> joined_names({"a": np.array([True, False, True]), "b": np.array([True, False, False])}).tolist()
    ['a b', '', 'a']
    """
    code = sum(
        (true.astype(np.int64) << bit for bit, true in enumerate(rows.values())), start=np.int64(0)
    )
    codes, inverse = np.unique(code, return_inverse=True)
    texts = [
        " ".join(name for bit, name in enumerate(rows) if one >> bit & 1) for one in codes.tolist()
    ]
    chosen: NDArray[np.object_] = np.array(texts, dtype=object)[inverse]
    return chosen
