"""
A process of its own that reads files, with limits of processor time and memory.

Readers that are not ours may take for ever, fill the memory or end the process for a file that is
damaged or made to harm. They run here: a fault ends this process, which is started again for the
next file. Of GDAL it has only the drivers of layers that hold their buildings themselves, and no
access to a network.
"""

import atexit
import multiprocessing.spawn
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, NamedTuple, cast

#: Drivers of GDAL that are used; its own work needs the one of memory.
DRIVERS = (
    *("GPKG", "GeoJSON", "GeoJSONSeq", "ESRIJSON", "ESRI Shapefile", "FlatGeobuf", "OSM"),
    *("MEM", "Memory"),
)

#: Drivers of archives of vector tiles, which have a process of their own.
_TILE_DRIVERS = ("MBTiles", "PMTiles", "MVT", "SQLite")

#: All other drivers of vector data of GDAL 3.4 to 3.13; the process looks for further ones.
_OTHER_DRIVERS = (
    "PCIDSK,PDS4,VICAR,JP2OpenJPEG,JPEG2000,JP2ECW,JP2KAK,JP2MrSID,PDF,MBTiles,BAG,EEDA,OGCAPI,"
    "netCDF,HDF5,HDF5Image,GDALG,MapInfo File,UK .NTF,LVBAG,OGR_SDTS,S57,DGN,OGR_VRT,"
    "CSV,NAS,GML,GPX,LIBKML,KML,TopoJSON,Interlis 1,Interlis 2,OGR_GMT,SQLite,"
    "OGR_DODS,ODBC,WAsP,PGeo,MSSQLSpatial,OGR_OGDI,PostgreSQL,PostgreSQL/PostGIS,MySQL,OCI,FileGDB,"
    "OpenFileGDB,DWG,DXF,CAD,IDB,GeoRSS,VFK,PGDUMP,GPSBabel,OGR_PDS,WFS,OAPIF,SOSI,EDIGEO,SVG,"
    "Idrisi,ARCGEN,XLS,ODS,XLSX,Elasticsearch,Walk,Carto,AmigoCloud,SXF,Selafin,JML,PLSCENES,CSW,"
    "VDV,GMLAS,MVT,NGW,MapML,HANA,Parquet,Arrow,GTFS,PMTiles,JSONFG,MiraMonVector,XODR,ADBC,AVCBin,"
    "AVCE00,AIVector,GenBin,ENVI,EHdr,ISIS3,HTTP,TIGER,Geoconcept,SEGUKOOA,SEGY,CouchDB,Cloudant,"
    "AeronavFAA,GFT,GME,OpenAir,XPlane,REC,BNA,Ingres,SDE,ArcObjects,DB2ODBC,GRASS,NULL"
)

#: Surroundings of the process: a proxy that no request can use stands for no network.
_SURROUNDINGS = {
    **dict.fromkeys(("GDAL_HTTP_PROXY", "GDAL_HTTPS_PROXY", "http_proxy"), "none://"),
    **dict.fromkeys(("https_proxy", "all_proxy", "HTTPS_PROXY", "ALL_PROXY"), "none://"),
    **dict.fromkeys(("no_proxy", "NO_PROXY"), ""),
    "GDAL_DRIVER_PATH": "disable",
    "PROJ_NETWORK": "OFF",
}

#: Time by the clock that a file may take over its limit of processor time: others use the machine,
#: and files may come from far away.
_PATIENCE = 20.0


class BeyondLimits(Exception):
    """A file takes more time or memory than it may, or its reader ends; the message says which."""


class Limits(NamedTuple):
    """
    Limits of reading a file.

    Attributes
    ----------
    seconds : float
        Processor time, s.
    memory : int
        Beside that of the program, bytes.
    """

    seconds: float
    memory: int


class _Reader:
    """The process and the one that started it; a copy made by ``fork`` starts its own."""

    def __init__(self, skipped: str) -> None:
        self.lock = threading.Lock()
        self.process: subprocess.Popen[bytes] | None = None
        self.owner = 0
        self.skipped = skipped

    def started(self) -> "subprocess.Popen[bytes]":
        """Return the process, which is started if it is not there."""
        # Exits, faults and limits end it; a copy of this program has none
        if self.process is None or self.owner != os.getpid() or self.process.poll() is not None:
            start = f"import sys; sys.path[:] = {sys.path!r}; "
            start += f"from {__name__} import _serve; _serve()"
            skipped = dict.fromkeys(("GDAL_SKIP", "OGR_SKIP"), self.skipped)
            self.process = subprocess.Popen(
                [os.fsdecode(multiprocessing.spawn.get_executable()), "-c", start],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, **_SURROUNDINGS, **skipped},
            )
            self.owner = os.getpid()
        return self.process

    def end(self, is_killed: bool = True) -> int:
        """End the process and return its exit code; without a kill it ends by itself."""
        process, self.process = self.process, None
        if process is None or self.owner != os.getpid():
            return 0
        if is_killed:
            process.kill()
        for pipe in (process.stdin, process.stdout):
            with suppress(OSError):
                pipe and pipe.close()
        return process.wait()


_reader = _Reader(_OTHER_DRIVERS)
_tile_reader = _Reader(
    ",".join({*_OTHER_DRIVERS.split(","), *DRIVERS} - {*_TILE_DRIVERS, "MEM", "Memory"})
)
atexit.register(_reader.end)
atexit.register(_tile_reader.end)


def read_apart(limits: Limits, function: Callable[..., Any], *arguments: Any) -> Any:
    """
    Call a function of a module in the process of readers.

    Parameters
    ----------
    limits : Limits
        Of this call.
    function : callable
        It and its arguments, its value and its errors are pickled.
    *arguments
        Of the function.

    Raises
    ------
    BeyondLimits
        If it takes more than the limits, or ends the process.
    Exception
        Whatever the function raises.
    """
    return _call(_reader, limits, function, arguments)


def read_tiles_apart(limits: Limits, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function as :func:`read_apart` does, where GDAL reads archives of tiles only."""
    return _call(_tile_reader, limits, function, arguments)


def _call(
    reader: _Reader, limits: Limits, function: Callable[..., Any], arguments: tuple[Any, ...]
) -> Any:
    """Call a function in one of the processes."""
    with reader.lock:
        process = reader.started()
        calls, answers = cast("IO[bytes]", process.stdin), cast("IO[bytes]", process.stdout)
        late = threading.Event()

        def stop() -> None:
            late.set()
            process.kill()

        clock = threading.Timer(limits.seconds * _PATIENCE, stop)
        clock.start()
        is_whole = False
        try:
            pickle.dump((limits, str(Path.cwd()), function, arguments), calls, protocol=5)
            calls.flush()
            is_value, answer = pickle.load(answers)  # noqa: S301 - of our own process
            # Memory that was short may not be free again
            is_whole = not isinstance(answer, MemoryError)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError) as error:
            code = reader.end(is_killed=False)
            raise BeyondLimits(_reason(limits, code, late.is_set())) from error
        finally:
            clock.cancel()
            # The rest of an answer must not be taken for the next one
            if not is_whole:
                reader.end()
    if is_value:
        return answer
    if isinstance(answer, MemoryError):
        raise BeyondLimits(_reason(limits, 0, False)) from answer
    raise answer


def _reason(limits: Limits, code: int, is_late: bool) -> str:
    """Return why a process did not answer, from its exit code."""
    if is_late or code == -getattr(signal, "SIGXCPU", 0):
        return f"reading it takes more than {limits.seconds:.0f} s of processor time"
    if code in (0, -getattr(signal, "SIGKILL", 9), -signal.SIGABRT):
        return f"reading it takes more than {limits.memory >> 20} MiB of memory"
    return f"its reader ends with code {code}"


def _serve() -> None:
    """Answer calls until there are no more; the first lines make sure that only answers go out."""
    calls, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            limits, folder, function, arguments = pickle.load(calls)  # noqa: S301 - ours
        except EOFError:
            return
        try:
            os.chdir(folder)
            _limit(limits)
            answer = (True, function(*arguments))
        except MemoryError as error:
            answer = (False, error)
        except Exception as error:  # noqa: BLE001 - it is raised where the call came from
            answer = (False, sendable(error))
        _limit(None)
        pickle.dump(answer, answers, protocol=5)
        answers.flush()


def sendable(error: Exception) -> Exception:
    """Return an error that can be pickled."""
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301 - an error of this process
    except (pickle.PickleError, AttributeError, LookupError, RuntimeError, TypeError, ValueError):
        # Classes of other packages that cannot be made of their arguments
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error.with_traceback(None)


def _limit(limits: Limits | None) -> None:
    """Limit the processor time and the memory of this process from now on; None: no longer."""
    try:
        import resource
    except ImportError:  # Windows has the limit by the clock only
        return
    endless = resource.RLIM_INFINITY
    seconds = memory = endless
    if limits is not None:
        used = resource.getrusage(resource.RUSAGE_SELF)
        seconds = int(used.ru_utime + used.ru_stime + limits.seconds) + 1
        memory = _memory() + limits.memory
    for kind, value in ((resource.RLIMIT_CPU, seconds), (resource.RLIMIT_AS, memory)):
        hard = resource.getrlimit(kind)[1]
        soft = hard if value == endless else value if hard == endless else min(value, hard)
        with suppress(ValueError, OSError):
            resource.setrlimit(kind, (soft, hard))
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _memory() -> int:
    """Return the addresses that this process uses, bytes; a guess where the system says nothing."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 4 << 30


class OtherDrivers(Exception):
    """GDAL has drivers that ``_OTHER_DRIVERS`` does not name; the names are the arguments."""


def require_own_drivers(names: Iterable[str]) -> None:
    """
    Check that GDAL has no drivers but ``DRIVERS``: a newer one may open other files.

    Raises
    ------
    OtherDrivers
        With the names of all others.
    """
    if others := sorted(set(names) - set(DRIVERS)):
        raise OtherDrivers(*others)


def read_layer_apart(limits: Limits, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function as :func:`read_apart` does, where GDAL has no drivers but ``DRIVERS``."""
    try:
        return read_apart(limits, function, *arguments)
    except OtherDrivers as error:
        # Drivers are left out when a process starts
        with _reader.lock:
            _reader.end()
            _reader.skipped += "".join(f",{name}" for name in error.args)
        return read_apart(limits, function, *arguments)
