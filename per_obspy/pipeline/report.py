"""The last stage: the risk table and the spectra become totals, figures and layers for a map."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq

from per_obspy.config import Run
from per_obspy.errors import require_extra
from per_obspy.progress import Progress
from per_obspy.report.evaluation import write_evaluation
from per_obspy.report.figures import draw_overview, draw_record_to_pair
from per_obspy.spectra.storage import read_spectra, region, write_spectra
from per_obspy.tables.risk import ranked
from per_obspy.tables.totals import RegionTotals, region_totals, write_totals

#: Pairs that a figure shows, evenly from all of them: more cannot be told apart.
SHOWN = 20_000


def require_extras(settings: Run) -> None:
    """
    Check that the optional libraries that the report needs are installed, before anything is computed.

    Raises
    ------
    MissingExtra
        If one is not.
    """
    if settings.geopackage:
        require_extra("gis", "pyogrio", "shapely")
    if settings.totals.h3 is not None:
        require_extra("gis", "h3")


def reported(settings: Run, folder: Path, shards: Sequence[Path], progress: Progress) -> list[Path]:
    """
    Write the report of what stands in the output folder, and return its files.

    Parameters
    ----------
    settings : Run
        What to do.
    folder : Path
        Of the results; without a risk table nothing but the spectra can be reported.
    shards : sequence of Path
        Stations.
    progress : callable
        Told when it begins and ends.
    """
    progress("report", 0, 1)
    outputs, risk = list[Path](), folder / "risk.parquet"
    if shards:
        write_spectra(region(read_spectra(shard) for shard in shards), folder / "spectra.nc")
        outputs.append(folder / "spectra.nc")
    if risk.exists():
        outputs += _figures(settings, risk, shards, folder) if shards else []
        totals = region_totals(risk, settings.totals, list(settings.screening.classes))
        write_totals(totals.table, folder / "totals.csv")
        outputs += [
            folder / "totals.csv",
            *write_evaluation(risk, folder, settings.simulation is not None),
        ]
        if settings.geopackage:
            outputs += _write_layers(settings, risk, totals, folder)
    progress("report", 1, 1)
    return outputs


def _figures(settings: Run, risk: Path, shards: Sequence[Path], folder: Path) -> list[Path]:
    """Draw the worst pair that a record was given to, and the region."""
    walk, overview = (folder / "figures" / name for name in ("worst_pair.png", "overview.png"))
    named = (piece[piece["station"] != ""] for piece in ranked(risk))
    worst = next((piece.iloc[0] for piece in named if len(piece)), None)
    draw_overview(_shown(risk), read_spectra(folder / "spectra.nc"), settings.name, overview)
    if worst is None:
        return [overview]
    (shard,) = (one for one in shards if one.stem == worst["station"].strip("."))
    draw_record_to_pair(read_spectra(shard), worst, walk)
    return [walk, overview]


def _shown(risk: Path) -> pd.DataFrame:
    """Return the pairs that a figure shows: every one of a small table, every tenth or so of a large one."""
    step = -(-pq.read_metadata(risk).num_rows // SHOWN)
    columns = ["rank", "state", "longitude", "latitude", "demand", "gap"]
    pieces = [piece[piece["rank"].to_numpy() % step == 1 % step] for piece in ranked(risk, columns)]
    shown: pd.DataFrame = pd.concat(pieces, ignore_index=True)
    return shown


def _write_layers(settings: Run, risk: Path, totals: RegionTotals, folder: Path) -> list[Path]:
    """Write the layers for QGIS with the optional libraries."""
    from per_obspy.report.gis import write_pairs_layer, write_totals_layer

    facts = {"name": settings.name, "simulated": str(settings.simulation is not None).lower()}
    write_pairs_layer(ranked(risk), list(settings.screening.classes), folder / "risk.gpkg", facts)
    write_totals_layer(*totals, folder / "totals.gpkg", facts)
    return [folder / "risk.gpkg", folder / "totals.gpkg"]
