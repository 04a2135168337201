"""Files of a screening by a design spectrum."""

from pathlib import Path

import pandas as pd

from per_obspy.inventory.schema import COLUMNS, COMPLETED, Column
from per_obspy.inventory.suspicions import ODD
from per_obspy.screening.by_spectrum.design import DESIGN
from per_obspy.screening.codes import rule_columns
from per_obspy.screening.columns import RESULTS
from per_obspy.tables.rounding import rounded_table
from per_obspy.tables.table_files import write_csv, write_described, write_parquet, write_rejected

FILES = ("design.csv", "design.parquet", "design.columns.csv", "rejected.csv")


def write_design(table: pd.DataFrame, folder: Path) -> list[Path]:
    """
    Write the files of a screening by a design spectrum, and return their paths.

    Parameters
    ----------
    table : DataFrame
        From :func:`per_obspy.screening.by_spectrum.design.design_table`.
    folder : Path
        Folder of ``design.csv``, ``design.parquet``, ``design.columns.csv``, ``rejected.csv``.
    """
    text, whole, columns, rejected = paths = [folder / name for name in FILES]
    odd = Column(ODD, "str", "", "what is odd in the row: flags of docs/inventories.md")
    known = COLUMNS | COMPLETED | RESULTS | DESIGN | rule_columns() | {ODD: odd}
    write_csv(rounded_table(table, own=known), text)
    write_parquet(table, whole)
    # Columns of the pair table that are not computed here are carried through
    carried = Column("", "", "", "carried through from the pair table")
    described = (known.get(name, carried)._replace(name=name) for name in map(str, table))
    write_described(described, columns)
    write_rejected(table.attrs["rejected"], rejected)
    return paths
