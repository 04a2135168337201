"""
Files of a ranked table in a folder of results.

``risk.parquet`` holds all rows, the worst first. A dataset ``risk/`` holds one Parquet file per
cell, each with its worst row first.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path, PurePath

from per_obspy.files import is_part, remove_file


def table_files(folder: Path, name: str = "risk") -> list[Path]:
    """
    Return the files of a ranked table in a folder of results.

    Parameters
    ----------
    folder : Path
        Of the results.
    name : str
        Of the table.

    Returns
    -------
    files : list of Path
        One file, or one per cell in the order of their names; empty without a table.
    """
    single = folder / f"{name}.parquet"
    if single.is_file():
        return [single]
    return sorted(path for path in (folder / name).glob("*.parquet") if not is_part(path))


def table_outputs(outputs: Mapping[str, str], name: str = "risk") -> dict[str, str]:
    """
    Return the outputs of a run that are files of its ranked table, with their hashes.

    Examples
    --------
    >>> table_outputs({"risk.parquet": "a", "risk.csv": "b"})
    {'risk.parquet': 'a'}
    >>> table_outputs({"risk/lat35_lon139.parquet": "c", "rows.parquet": "d"})
    {'risk/lat35_lon139.parquet': 'c'}
    """
    places = (f"{name}.parquet", name)
    return {file: digest for file, digest in outputs.items() if PurePath(file).parts[0] in places}


def table_name(folder: Path, name: str = "risk") -> str:
    """Return the name of a ranked table in a folder of results: a file, or a folder of cells."""
    return f"{name}/" if (folder / name).is_dir() else f"{name}.parquet"


def listed_outputs(outputs: Iterable[str], name: str = "risk") -> list[str]:
    """
    Return the names of outputs in their order, with all cells of a dataset as one.

    Examples
    --------
    >>> listed_outputs(["run.json", "risk/lat35_lon139.parquet", "risk/no_place.parquet"])
    ['risk/ (2 cells)', 'run.json']
    """
    names = sorted(outputs)
    others = [file for file in names if PurePath(file).parts[0] != name]
    cells = len(names) - len(others)
    return sorted([*others, f"{name}/ ({cells} cells)"]) if cells else others


def remove_table(folder: Path, name: str = "risk") -> None:
    """Remove the files of a ranked table; other files in the folder of its cells stay."""
    for path in (folder / f"{name}.parquet", *(folder / name).glob("*.parquet")):
        remove_file(path)
    with suppress(OSError):
        (folder / name).rmdir()
