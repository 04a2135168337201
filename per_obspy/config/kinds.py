"""What a configuration of a screening holds: a run, or a spectrum instead of records."""

from pathlib import Path

from per_obspy.config.run import Design, Run
from per_obspy.config.section import read_toml
from per_obspy.errors import CatalogError


def screening_kind(path: Path) -> type[Run] | type[Design]:
    """
    Return what a TOML file configures, by the key that the others do not have.

    Raises
    ------
    CatalogError
        If the file cannot be read or is none of them.
    """
    content = read_toml(path)
    if isinstance(content.get("spectrum"), str):
        return Design
    if content.keys() & {"records", "simulation"}:
        return Run
    raise CatalogError(
        str(path), "nothing to screen by: give records or simulation (a run), or spectrum (a design spectrum)"
    )
