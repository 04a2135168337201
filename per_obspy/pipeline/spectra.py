"""Parts of a run that can be asked for alone: the spectra of some records, their processing."""

from collections.abc import Iterable, Sequence
from functools import reduce
from operator import add
from pathlib import Path

from per_obspy.config import Processing, Spectra
from per_obspy.errors import Rejection
from per_obspy.jobs.station import Done, Job, do_stations
from per_obspy.progress import Progress
from per_obspy.records.folder import find_stations
from per_obspy.report.spectra import draw_spectra, draw_state_space
from per_obspy.spectra.storage import read_spectra, region, write_spectra
from per_obspy.tables.writing import write_rejected


def spectra_of(
    sources: Sequence[Path],
    output: Path,
    processing: Processing,
    grid: Spectra,
    workers: int,
    progress: Progress,
) -> tuple[list[Done], tuple[Rejection, ...]]:
    """
    Write the spectra of every station in some files and folders into one netCDF file.

    Parameters
    ----------
    sources : sequence of Path
        Waveform files, archives, or folders of them with StationXML beside.
    output : Path
        netCDF file. Beside it, in a folder of its name with ``.stations``, stays one shard a
        station; those that are still true are not computed again. What was left out goes to
        ``.rejected.csv``.
    processing, grid : Processing, Spectra
        Settings.
    workers : int
        Number of processes.
    progress : callable
        Told of every station.

    Returns
    -------
    done : list of Done
        Every station, sorted by name.
    rejected : tuple of Rejection
        What was left out.

    Raises
    ------
    CatalogError
        If a source is missing or holds no record.
    """
    jobs, unread = jobs_of(sources, output.with_suffix(".stations"), processing, grid)
    done, rejected = all_done(jobs, unread, workers, progress)
    write_rejected(rejected, output.with_suffix(".rejected.csv"))
    if shards := [one.shard for one in done if one.shard]:
        write_spectra(region(read_spectra(shard) for shard in shards), output)
    return done, rejected


def all_done(
    jobs: Sequence[Job], unread: Iterable[Rejection], workers: int, progress: Progress
) -> tuple[list[Done], tuple[Rejection, ...]]:
    """Return every station, sorted by name, and everything that was left out."""
    done = []
    for one in do_stations(jobs, workers):
        done.append(one)
        progress("stations", len(done), len(jobs))
    done.sort(key=lambda one: one.station)
    return done, (*unread, *(row for one in done for row in one.rejected))


def jobs_of(
    sources: Sequence[Path], shards: Path, processing: Processing, grid: Spectra
) -> tuple[list[Job], list[Rejection]]:
    """Return one job a station, which makes spectra, and what in the sources is no record."""
    found = [find_stations(source) for source in sources]
    files: dict[str, tuple[Path, ...]] = {}
    for contents in found:
        for name, paths in contents.stations.items():
            files[name] = (*files.get(name, ()), *paths)
    inventories = [contents.inventory for contents in found if contents.inventory]
    everything = reduce(add, inventories) if inventories else None
    jobs = [
        Job(
            station=name,
            source=paths,
            inventory=everything and everything.select(*name.split(".", 1)),
            event=None,
            processing=processing,
            spectra=grid,
            shard=shards / f"{name.strip('.')}.nc",
            simulated=False,
        )
        for name, paths in sorted(files.items())
    ]
    return jobs, [one for contents in found for one in contents.rejected]


def plot_station(shard: Path, damping: float, period: float, folder: Path) -> tuple[Path, Path]:
    """
    Draw the spectra of a station, and the state space of one oscillator along its stronger component.

    Parameters
    ----------
    shard : Path
        From :func:`spectra_of`.
    damping, period : float
        Of the oscillator, fraction of critical; s.
    folder : Path
        Where the two PNG files go.

    Returns
    -------
    spectra, state_space : Path
        The files.
    """
    station = read_spectra(shard)
    name = station["station"].item()
    spectra, state_space = folder / f"{name}.spectra.png", folder / f"{name}.state_space.png"
    draw_spectra(station, damping, spectra)
    strongest = max(station["acceleration"].to_numpy(), key=lambda motion: abs(motion).max())
    draw_state_space(strongest, float(station["sampling_interval"]), period, damping, state_space)
    return spectra, state_space
