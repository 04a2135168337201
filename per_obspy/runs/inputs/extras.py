"""Optional libraries that the settings of a command need."""

from per_obspy.config import Design, Ensemble, Run
from per_obspy.errors import require_extra


def require_extras(settings: Run | Design | Ensemble) -> None:
    """
    Check that the optional libraries of a screening are installed, before anything is computed.

    Raises
    ------
    MissingExtra
        If one is not.
    """
    if settings.geopackage:
        require_extra("gis", "pyogrio", "shapely")
    if settings.report.background is not None:
        require_extra("gis", "pyogrio", "pyproj", "shapely")
    if settings.spreadsheet:
        require_extra("spreadsheet", "openpyxl")
    if isinstance(settings, Run) and settings.totals.h3 is not None:
        require_extra("gis", "h3")
