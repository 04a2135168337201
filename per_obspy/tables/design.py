"""The files of a screening by a design spectrum."""

from pathlib import Path

import pandas as pd

from per_obspy.inventory.files.writing import write_pairs
from per_obspy.inventory.schema import COLUMNS, COMPLETED, Column
from per_obspy.screening.by_spectrum.design_table import DESIGN
from per_obspy.screening.codes import rule_columns
from per_obspy.screening.columns import RESULTS
from per_obspy.tables.writing import write_described, write_rejected


def write_design(table: pd.DataFrame, folder: Path) -> list[Path]:
    """
    Write ``design.csv``, ``design.parquet``, ``design.columns.csv`` and ``rejected.csv``, and return their paths.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.screening.by_spectrum.design_table.design_table`.
    folder : Path
        Where to.
    """
    paths = [
        folder / name
        for name in ("design.csv", "design.parquet", "design.columns.csv", "rejected.csv")
    ]
    write_pairs(table, paths[0])
    write_pairs(table, paths[1])
    known = COLUMNS | COMPLETED | RESULTS | DESIGN | rule_columns()
    carried = Column("", "", "", "carried through from the pair table")
    write_described(
        (known.get(name, carried)._replace(name=name) for name in map(str, table)), paths[2]
    )
    write_rejected(table.attrs["rejected"], paths[3])
    return paths
