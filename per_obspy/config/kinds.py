"""What a configuration of a screening holds: a run, a spectrum instead of records, or several scenarios."""

from pathlib import Path

from per_obspy.config.ensemble import Ensemble
from per_obspy.config.run import Design, Run
from per_obspy.config.section import read_toml
from per_obspy.errors import CatalogError


def screening_kind(path: Path) -> type[Run] | type[Design] | type[Ensemble]:
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
    if isinstance(content.get("scenario"), list):
        return Ensemble
    if content.keys() & {"records", "simulation"}:
        return Run
    raise CatalogError(
        str(path),
        "nothing to screen by: give records or simulation (a run), spectrum (a design spectrum) or [[scenario]] "
        "(an ensemble)",
    )
