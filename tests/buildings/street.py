"""Pair tables of made-up streets, which the tests of rows share."""

import numpy as np
import pandas as pd
import pyarrow as pa


def street(*pairs, **columns):
    """Return a pair table: each pair is building 1, building 2, azimuth and gap."""
    first, second, azimuth, gap = zip(*pairs, strict=True)
    table = pd.DataFrame(
        {
            "pair_id": [f"p{number}" for number in range(len(pairs))],
            "building_id_1": first,
            "building_id_2": second,
            "azimuth": np.array(azimuth, dtype=float),
            "gap": np.array(gap, dtype=float),
            "derived": "",
        }
    )
    # all at one place, which is no contradiction
    for i in (1, 2):
        table[f"longitude_{i}"], table[f"latitude_{i}"] = 10.0, 45.0
    return table.assign(**columns)


def terrace(count, azimuth=90.0, gaps=0.0):
    """Return the pairs of a straight row of buildings a, b, c ..."""
    names = [f"b{number:04}" for number in range(count)]
    width = np.broadcast_to(gaps, count - 1)
    return street(*zip(names[:-1], names[1:], [azimuth] * (count - 1), width, strict=True))


def table_of(pairs):
    """Return pairs as the search reads them, with the numbers of their identifiers."""
    names = [pairs.get(f"building_id_{i}", pd.Series("", index=pairs.index)) for i in (1, 2)]
    occurring = sorted({*names[0], *names[1]} - {""})
    codes = {name: number for number, name in enumerate(occurring)} | {"": -1}
    numbers = {f"code_{i}": name.map(codes) for i, name in enumerate(names, 1)}
    return pa.Table.from_pandas(pairs.assign(**numbers), preserve_index=False)
