"""Write a table of building pairs, CSV or Parquet."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from per_obspy.errors import CatalogError
from per_obspy.files import written_whole
from per_obspy.inventory.files.text_cells import cells


def write_pairs(
    pairs: pd.DataFrame, path: str | Path, metadata: Mapping[bytes, bytes] | None = None
) -> None:
    """
    Write a pair table in the form that ``read_pairs`` reads, whole or not at all.

    Parameters
    ----------
    pairs : DataFrame
        By the schema.
    path : str or Path
        ``.csv``, with texts as :mod:`.text_cells` has them, or ``.parquet``.
    metadata : mapping of bytes to bytes, optional
        Added to those of a Parquet file.

    Raises
    ------
    CatalogError
        If the suffix is another one.
    """
    file = Path(path)
    if file.suffix.lower() not in (".csv", ".parquet"):
        raise CatalogError(str(file), f"unknown suffix {file.suffix!r}, expected .csv or .parquet")
    with written_whole(file) as part:
        if file.suffix.lower() == ".csv":
            cells(pairs).to_csv(part, index=False)
        else:
            plain = pairs.copy(deep=False)
            plain.attrs = {}  # rejected rows are written to a separate file
            table = pa.Table.from_pandas(plain, preserve_index=False)
            known = {**(table.schema.metadata or {}), **(metadata or {})}
            pq.write_table(table.replace_schema_metadata(known), part)
