"""Losses of pair rows in a run: fewer rows than in the run before, and rejected rows."""

import json
from collections.abc import Mapping
from pathlib import Path

from per_obspy.config import Pairs, Run


def number_of_rows(record: Path) -> int | None:
    """
    Return the number of rows of the pair tables by ``run.json`` of the run before.

    Parameters
    ----------
    record : Path
        ``run.json`` of an earlier run.

    Returns
    -------
    int or None
        That of the run before, if this one is unfinished; None if there is no record, or if it
        cannot be read.
    """
    try:
        content = json.loads(record.read_text(encoding="utf-8"))
        # An unfinished run keeps the number of the one before it
        if "counts" not in content:
            earlier: int | None = content["earlier_rows"]
            return earlier
        return _rows(content["counts"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def losses(settings: Run, counts: Mapping[str, int], earlier: int | None) -> list[str]:
    """
    Return one sentence per kind of loss.

    Parameters
    ----------
    settings : Run
        Its ``pairs.largest_rejected_share`` is the largest share of rejected rows.
    counts : mapping
        Counts of the run's record.
    earlier : int or None
        Number of rows in the run before it.
    """
    sentences = []
    rows, rejected = _rows(counts), counts["rejected_pair"]
    # A table that was only half saved
    if earlier is not None and rows < earlier:
        sentences.append(
            f"rows lost: the pair tables hold {rows} rows, {earlier} in the previous run of this "
            "folder"
        )
    # A table whose rows are wrong, or far from every station
    limit = (settings.pairs or Pairs.model_construct()).largest_rejected_share
    if rejected > limit * rows:
        sentences.append(
            f"rows rejected: {rejected} of {rows} rows ({rejected / rows:.0%}), more than "
            f"pairs.largest_rejected_share = {limit:g}; see rejected.csv"
        )
    return sentences


def _rows(counts: Mapping[str, int]) -> int:
    """Return the number of rows from the counts of a run."""
    return counts["pairs"] + counts["rejected_pair"]
