"""Spectra of some records alone, without pairs: one netCDF file and figures."""

from collections.abc import Sequence
from concurrent.futures import Executor
from pathlib import Path

from per_obspy.config import Engine, Processing, Spectra
from per_obspy.errors import Rejection
from per_obspy.files import remove_dead_parts
from per_obspy.jobs.executor import opened_executor
from per_obspy.jobs.station import FinishedStation
from per_obspy.pipeline.stations import all_rejections, finished_stations, station_jobs
from per_obspy.progress import Progress
from per_obspy.records.sources import find_path_sources
from per_obspy.report.spectra import draw_spectra, draw_state_space
from per_obspy.spectra.storage import read_spectra, region, write_spectra
from per_obspy.tables.table_files import write_rejected


def spectra_of(
    sources: Sequence[Path],
    output: Path,
    processing: Processing,
    grid: Spectra,
    run: tuple[int, Executor | None, Progress],
) -> tuple[list[FinishedStation], tuple[Rejection, ...]]:
    """
    Write the spectra of every station in some files and folders into one netCDF file.

    Parameters
    ----------
    sources : sequence of Path
        Waveform files, archives, or folders of them with StationXML.
    output : Path
        netCDF file. The folder of the same name with ``.stations`` keeps the station files; valid
        ones are not computed again. Rejections are written to ``.rejected.csv``.
    processing, grid : Processing, Spectra
        Settings.
    run : (int, Executor or None, callable)
        Number of processes, where to work instead, and the function that is called for every
        station.

    Returns
    -------
    done : list of FinishedStation
        Every station, sorted by name.
    rejected : tuple of Rejection
        Rejected inputs, each with its reasons.

    Raises
    ------
    CatalogError
        If a source is missing or holds no record.
    """
    shards = output.with_suffix(".stations")
    remove_dead_parts(shards)
    found = find_path_sources(sources)
    jobs = station_jobs(found.stations, shards, processing, grid)
    workers, executor, progress = run
    with opened_executor(Engine(), executor, output.absolute().parent) as used:
        done = finished_stations(jobs, workers, used, progress)
    rejected = all_rejections(found.rejected, done)
    write_rejected(rejected, output.with_suffix(".rejected.csv"))
    # The file of the region needs a station with usable records
    spectra = [station.spectra for station in done if station.spectra is not None]
    if spectra:
        write_spectra(region(spectra), output)
    return done, tuple(rejected)


def plot_station(shard: Path, damping: float, period: float, folder: Path) -> tuple[Path, Path]:
    """
    Draw the spectra of a station, and the state space of one oscillator along the stronger motion.

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
    # The name of the station file lacks the dot of a missing network, which would hide it
    name = shard.stem
    spectra, state_space = folder / f"{name}.spectra.png", folder / f"{name}.state_space.png"
    draw_spectra(station, damping, spectra)
    draw_state_space(station, period, damping, state_space)
    return spectra, state_space
