"""Gaps that are possible row by row, but whose whole column looks as if it had another unit."""

from typing import NamedTuple, Self

import pyarrow as pa
import pyarrow.compute as pc

#: Column of the gaps.
GAP = "gap"

#: Neighbours are sought within about this gap, m: if most gaps are wider, the unit is another one.
WIDE_GAP = 3.0

#: Fewest gaps, all in whole metres, that suggest centimetres: surveys in metres have
#: decimals.
FEWEST_WHOLE = 5


class GapCounts(NamedTuple):
    """
    Numbers of gaps of some rows.

    Attributes
    ----------
    above_zero : int
        Rows whose gap is a number above 0.
    wide : int
        Of these, those above :data:`WIDE_GAP`.
    whole : int
        Of these, those of whole metres.
    """

    above_zero: int = 0
    wide: int = 0
    whole: int = 0

    def joined(self, other: Self) -> Self:
        """Return the numbers of both."""
        return type(self)(*(first + second for first, second in zip(self, other, strict=True)))


def gap_counts(gaps: pa.ChunkedArray) -> GapCounts:
    """
    Return the numbers of gaps, before any row is rejected.

    Parameters
    ----------
    gaps : ChunkedArray
        m; text with numbers among it counts where it is one.

    Examples
    --------
    >>> gap_counts(pa.chunked_array([["0", "5", "0.05", "five", ""]]))
    GapCounts(above_zero=2, wide=1, whole=1)
    """
    # Text is a number where it looks like one
    if pa.types.is_string(gaps.type):
        is_number = pc.match_substring_regex(gaps, r"^\s*[+-]?\d{1,300}(\.\d{0,300})?\s*$")
        text = pc.utf8_trim_whitespace(pc.if_else(is_number, gaps, None))
        gaps = pc.cast(text, pa.float64())
    if not (pa.types.is_floating(gaps.type) or pa.types.is_integer(gaps.type)):
        return GapCounts()
    positive = pc.drop_null(pc.filter(gaps, pc.fill_null(pc.greater(gaps, 0), False)))
    wide, whole = pc.greater(positive, WIDE_GAP), pc.equal(pc.floor(positive), positive)
    return GapCounts(len(positive), pc.sum(wide).as_py() or 0, pc.sum(whole).as_py() or 0)


def gap_suspicions(gaps: GapCounts) -> list[str]:
    """
    Return a warning if the gaps look as if they were in centimetres or millimetres.

    Examples
    --------
    >>> gap_suspicions(GapCounts(6, 0, 6))
    ['all 6 gaps above 0 are whole metres: given in centimetres or millimetres?']
    """
    mend = "given in centimetres or millimetres?"
    if 2 * gaps.wide > gaps.above_zero:
        return [
            f"{gaps.wide} of {gaps.above_zero} gaps above 0 are wider than {WIDE_GAP:g} m: {mend}"
        ]
    if gaps.whole == gaps.above_zero >= FEWEST_WHOLE:
        return [f"all {gaps.whole} gaps above 0 are whole metres: {mend}"]
    return []
