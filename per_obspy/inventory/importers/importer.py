"""Description of an importer's source, and buildings as they are in a file."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray


def unchanged(attributes: pd.DataFrame) -> pd.DataFrame:
    """Return the attributes of a source whose cells need no conversion."""
    return attributes


class Importer(NamedTuple):
    """
    Names and codes of one source for the columns of the pair table.

    Attributes
    ----------
    name : str
        The source.
    needed : tuple of tuple of str
        Sets of columns. A layer with all columns of one set is of this source.
    columns : dict
        Name of a building's quantity in the schema -> the source's column, which may be absent.
    systems : dict
        The source's code, material and lateral system joined by a blank -> structural system of the
        schema; other codes stay empty and are derived.
    system_columns : tuple of str
        The source's columns of material and lateral system; empty if it has none.
    carried : tuple of str
        Columns to carry along unchanged.
    class_column : str or None
        The source's column of use or type, by which missing heights are estimated from buildings of
        the same layer; empty if all buildings of a layer are one class, None if heights are not
        estimated.
    adapted : callable
        Return the attributes with converted cells.
    """

    name: str
    needed: tuple[tuple[str, ...], ...]
    columns: dict[str, str]
    systems: dict[str, str] = MappingProxyType({})  # type: ignore[assignment]
    system_columns: tuple[str, ...] = ()
    carried: tuple[str, ...] = ()
    class_column: str | None = None
    adapted: Callable[[pd.DataFrame], pd.DataFrame] = unchanged


class RawLayer(NamedTuple):
    """
    A layer as its file has it.

    Attributes
    ----------
    geometries : (n_features,) ndarray of shapely geometries
        First coordinate east, second north; None where a feature has none.
    attributes : DataFrame
        One row per feature.
    crs : object
        Coordinate reference system, in any form that pyproj understands.
    faults : mapping of int to str
        Position of a feature -> why it cannot be used, where the reader found a fault.
    """

    geometries: NDArray[np.object_]
    attributes: pd.DataFrame
    crs: Any
    faults: Mapping[int, str] = MappingProxyType({})
