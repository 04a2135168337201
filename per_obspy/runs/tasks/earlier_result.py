"""Risk table of the run of an earlier earthquake, from which a run starts."""

from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from pyarrow.dataset import dataset

from per_obspy.config import Run
from per_obspy.errors import CatalogError
from per_obspy.files import content_hash, file_hash
from per_obspy.results.ranked_table import table_files
from per_obspy.resume import StatusError, read_status
from per_obspy.runs.output_folder import RECORD, UNFINISHED
from per_obspy.screening.earlier_damage import MAY_HAVE, NEEDED


class EarlierResult(NamedTuple):
    """Files of a risk table, and a hash of their contents."""

    files: tuple[Path, ...]
    key: str


def earlier_result(settings: Run) -> EarlierResult | None:
    """Return the table from which a run starts; None if it starts from undamaged pairs."""
    if settings.after is None:
        return None
    files = table_files(settings.after)
    return EarlierResult(tuple(files), content_hash({file.name: file_hash(file) for file in files}))


def check_earlier(settings: Run, folder: Path) -> None:
    """
    Check that the results from which a run starts are those of another, finished run.

    Raises
    ------
    CatalogError
        If they are not.
    """
    after = settings.after
    if after is None:
        return
    if after.resolve() == folder:
        raise CatalogError(str(after), "after: holds the results of this run itself")
    try:
        is_finished = read_status(after / RECORD).get("state") != UNFINISHED
    except StatusError:
        is_finished = False
    files = table_files(after)
    if not is_finished or not files:
        raise CatalogError(str(after), "after: no finished run with a risk table here")
    # Results of other versions, and of a design spectrum
    try:
        names = dataset(files).schema.names
    except (pa.ArrowException, OSError) as error:
        raise CatalogError(str(files[0]), "after: a damaged table, not Parquet") from error
    if missing := [name for name in NEEDED if name not in names]:
        reason = f"after: has no column {missing[0]}: do this run again with this version"
        raise CatalogError(str(files[0]), reason)


def earlier_rows(earlier: EarlierResult, names: pd.Series) -> pd.DataFrame:
    """Return the rows of an earlier table for the pairs of these names."""
    table = dataset(list(earlier.files))
    columns = [*NEEDED, *(name for name in MAY_HAVE if name in table.schema.names)]
    rows = table.to_table(columns=columns, filter=pc.field("pair_id").isin(names.tolist()))
    found: pd.DataFrame = rows.to_pandas()
    return found
