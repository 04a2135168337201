"""Columns of numbers in the unit of the schema."""

import pyarrow as pa
import pyarrow.compute as pc

from per_obspy.inventory.recognition.units import Unit


def converted(numbers: pa.ChunkedArray, unit: Unit) -> pa.ChunkedArray:
    """
    Return numbers in the unit of the schema.

    Examples
    --------
    >>> converted(pa.chunked_array([[7.0, None]]), Unit("cm", 1, 100)).to_pylist()
    [0.07, None]
    """
    scaled = pc.multiply(pc.cast(numbers, pa.float64()), float(unit.numerator))
    return pc.divide(scaled, float(unit.denominator))


def converted_texts(cells: pa.ChunkedArray, unit: Unit) -> pa.ChunkedArray:
    """
    Return text with its numbers in the unit of the schema; other cells are unchanged.

    Examples
    --------
    >>> converted_texts(pa.chunked_array([["7", "five", ""]]), Unit("cm", 1, 100)).to_pylist()
    ['0.07', 'five', '']
    """
    texts = [_converted_text(cell, unit) for cell in cells.to_pylist()]
    return pa.chunked_array([pa.array(texts, pa.string())])


def _converted_text(cell: str | None, unit: Unit) -> str | None:
    """Return one cell."""
    try:
        number = float(cell or "")
    except ValueError:
        return cell
    return repr(number * unit.numerator / unit.denominator)
