"""
The one place where ObsPy reads files: allowed formats only, and every error is a rejection.

ObsPy would unpickle a Stream, fetch texts that look like a URL, follow names of files that a file
holds, and unpack archives without a limit. Formats are therefore found among those listed here, and
files are handed over as bytes. Readers that neither belong to this package nor read most records
work in a process of their own, with limits of time and memory.
"""

import glob
import re
import tarfile
import warnings
import zipfile
import zlib
from collections.abc import Callable, Collection
from io import BytesIO
from pathlib import Path
from typing import Any

import obspy
from obspy.core.util.base import ENTRY_POINTS
from obspy.core.util.misc import buffered_load_entry_point

from per_obspy.errors import PerError, RecordRejected
from per_obspy.files import scratch_folder, writing
from per_obspy.formats.knet import require_whole_numbers
from per_obspy.formats.sac import require_coordinates
from per_obspy.reader_process import BeyondLimits, Limits, read_apart
from per_obspy.records.archive import LIMITS, SMALL, unpacked

#: Reason of a rejection where no format plugin knows a file.
UNKNOWN_FORMAT = "its format is unknown"

#: Formats of ObsPy that may be read, by kind of plugin. Left out are PICKLE, which runs code that
#: the file holds; CSS and NNSA_KB_CORE, which read any file that the file names; CSZ, which unpacks
#: without a limit; GSE1 and GSE2, whose decoder writes beyond its memory for damaged files; SC3ML,
#: which SCML has replaced; and what is no recorded strong motion: exploration (RG16, SEG2, SEGY,
#: SU), the Moon (ALSEP), sound (WAV), a volcano's network (DMX) and simulation (CYBERSHAKE).
_FORMATS = {
    "waveform": "MSEED SAC SEISAN SACXY Q SH_ASC SLIST TSPAIR Y WIN AH PDAS KINEMETRICS_EVT GCF"
    " KNET REFTEK130 AFAD BHRC COSMOS CSMIP_V1 CSMIP_V2 CWB DYNA GEONET ITACA MSEED3 NSMN PEER_AT2"
    " RENADIC SMC UNAM USC",
    "event": "QUAKEML SCML NLLOC_HYP CMTSOLUTION CSV EVENTTXT EVT FNETMT FOCMEC GSE2 HYPODDPHA"
    " IMS10BULLETIN MCHEDR NDK NORDIC SCARDEC ZMAP",
    "inventory": "STATIONXML SEED RESP SCML INVENTORYXML STATIONTXT XSEED",
}
FORMATS = {kind: frozenset(names.split()) for kind, names in _FORMATS.items()}

#: Formats that are read in this process: those of this package, and the usual ones of ObsPy, whose
#: readers believe no size and run through a file once.
_HERE = {
    *("MSEED", "SAC", "KNET", "QUAKEML", "STATIONXML", "STATIONTXT", "AFAD", "BHRC", "COSMOS"),
    *("CSMIP_V1", "CSMIP_V2", "CWB", "DYNA", "GEONET", "ITACA", "NSMN", "PEER_AT2", "RENADIC"),
    *("MSEED3", "SMC", "UNAM", "USC"),
}

#: format -> check of its content
_CHECKS: dict[str, Callable[[bytes, str], None]] = {
    "KNET": require_whole_numbers,
    "SAC": require_coordinates,
}

#: name of a reader of ObsPy -> kind of its plugins
_KINDS = {"read": "waveform", "read_events": "event", "read_inventory": "inventory"}

#: Formats whose samples are in a second file of the same name.
_TWO_FILES = ("Q",)

#: First bytes of files that gzip or bzip2 packed, which are unpacked here.
_PACKED = (b"\x1f\x8b", b"BZh")

#: Lines of a plain table that may hold titles, and a line of numbers.
TITLES = 8
_NUMBERS = re.compile(r"\s*+(?:[-+]?[\d.]++(?:[eEdD][-+]?\d++)?[\s,;]*+)++")
#: first bytes of files that other programs packed -> their name
_OTHER_PACKERS = {b"\xfd7zXZ\x00": "xz", b"\x28\xb5\x2f\xfd": "Zstandard", b"7z\xbc\xaf": "7-Zip"}

#: Largest size of an unpacked file: a day of three components at 200 Hz as text has 400 MB.
LARGEST_UNPACKED = 512 * 1024**2


def read_content(reader: Callable[..., Any], content: bytes, path: Path, **options: Any) -> Any:
    """
    Call a reader of ObsPy on the bytes of a file, so that the file itself is opened only once.

    Parameters
    ----------
    reader : callable
        ``obspy.read``, ``obspy.read_inventory`` or ``obspy.read_events``.
    content : bytes
        Of the file, perhaps packed by gzip or bzip2.
    path : Path
        File, or a member of an archive as ``records.archive`` names it.
    **options
        For the reader.

    Raises
    ------
    RecordRejected
        Whatever the reader raises.
    """
    return read_bytes_with_obspy(reader, _unpacked(content, path), path, **options)


def read_bytes_with_obspy(
    reader: Callable[..., Any], content: bytes, source: Path | str, **options: Any
) -> Any:
    """
    Call a reader of ObsPy on the answer of a service, or on a part of a file.

    Parameters and errors are those of :func:`read_content`; the source of the content is named
    in messages. Errors of ObsPy's bare Exception, or of any library below, reject.
    """
    kind = _KINDS[reader.__name__]
    beside = isinstance(source, Path) and source.is_file()
    try:
        name = options.pop("format", None) or _format(kind, content)
        # Samples in a second file are found by the path of the first only
        name = name or (_detected(kind, str(source), _TWO_FILES) if beside else None)
        if name not in FORMATS[kind]:
            raise RecordRejected(str(source), _unknown(content))
        # Faults that ObsPy would not notice, or not survive
        if name in _CHECKS:
            _CHECKS[name](content, str(source))
        options |= {"format": name, "check_compression": False}
        if name in _HERE:
            return reader(_named(content, str(source)), **options)
        place = glob.escape(str(source)) if name in _TWO_FILES and beside else None
        return _value_apart(reader.__name__, content, place, options)
    except BeyondLimits as error:
        raise RecordRejected(str(source), f"{error}: damaged, or no {name} file") from error
    except PerError:
        raise
    except Exception as error:
        raise RecordRejected(str(source), f"ObsPy cannot read it: {_reason(error)}") from error


def _unpacked(content: bytes, path: Path) -> bytes:
    """Return bytes that gzip or bzip2 packed, up to a limit of size; any other as they are."""
    if not content.startswith(_PACKED):
        return content

    def check(total: int) -> None:
        problem = ""
        if total > LARGEST_UNPACKED:
            problem = f"{LARGEST_UNPACKED // 1024**2} MiB"
        elif total > max(LIMITS.largest_ratio * len(content), SMALL):
            problem = f"{LIMITS.largest_ratio:g} times its packed size"
        if problem:
            raise RecordRejected(str(path), f"it unpacks to more than {problem}: unpack it by hand")

    # Pieces are joined in place, so that they are in memory once
    whole = BytesIO()
    try:
        whole.writelines(unpacked(BytesIO(content), content[:4], check))
    except (OSError, EOFError, zlib.error) as error:
        raise RecordRejected(str(path), f"the packed file is damaged: {error}") from error
    return whole.getvalue()


def _named(content: bytes, name: str) -> BytesIO:
    """Return bytes of a file under its name, which may end with a direction."""
    file = BytesIO(content)
    file.name = name
    return file


def _value_apart(reader: str, content: bytes, *arguments: Any) -> Any:
    """
    Return what a reader in the process of readers returns, and pass its warnings on.

    Limits are reasoned: WIN, the slowest reader, takes 5 s for each MiB; numbers in memory, and
    texts of a few letters, take at most 40 times their place in a file.
    """
    limits = Limits(20.0 + 20.0 * len(content) / 2**20, (1 << 30) + 40 * len(content))
    value, doubts = read_apart(limits, _read_apart, reader, content, *arguments)
    for doubt in doubts:
        warnings.warn(doubt, stacklevel=2)
    return value


def _read_apart(
    reader: str, content: bytes, place: str | None, options: dict[str, Any]
) -> tuple[Any, list[str]]:
    """Read a file, by its bytes or its place, in the process of readers; return warnings too."""
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        value = getattr(obspy, reader)(place or BytesIO(content), **options)
    return value, [str(doubt.message) for doubt in doubts]


def _format(kind: str, content: bytes) -> str | None:
    """Return the allowed format of bytes; None where none knows them."""
    try:
        return _detected(kind, BytesIO(content), FORMATS[kind])
    except TypeError:
        # Some formats are recognised in named files only
        with scratch_folder() as folder:
            file = folder / "record"
            with writing(file):
                file.write_bytes(content)
            return _detected(kind, str(file), FORMATS[kind])


def _detected(kind: str, file: BytesIO | str, allowed: Collection[str]) -> str | None:
    """Return the first allowed format, in ObsPy's order, whose plugin knows a file."""
    for name, point in ENTRY_POINTS[kind].items():
        if name not in allowed:
            continue
        group = f"obspy.plugin.{kind}.{name}"
        is_format = buffered_load_entry_point(point.dist.name, group, "isFormat")
        if is_format(file):
            return str(name)
        if not isinstance(file, str):
            file.seek(0)
    return None


def _unknown(content: bytes) -> str:
    """Return the reason why no format is found; an archive is opened by its name only."""
    if zipfile.is_zipfile(BytesIO(content)) or tarfile.is_tarfile(BytesIO(content)):
        return "it is an archive: its name must end with .zip, .tar, .tar.gz, .tar.bz2 or .tar.xz"
    for mark, packer in _OTHER_PACKERS.items():
        if content.startswith(mark):
            return f"it is packed by {packer}: unpack it first"
    problem = f"ObsPy cannot read it: {UNKNOWN_FORMAT}"
    # Lines of numbers alone, after the first ones
    lines = content[:4096].decode("ascii", "replace").splitlines()[TITLES:-1]
    if len(lines) > 1 and all(map(_NUMBERS.fullmatch, lines)):
        return f"{problem}; a table of samples is read where [[records.columns]] describes it"
    return problem


def _reason(error: Exception) -> str:
    """Return the message of an error on one line; an object in memory is the content."""
    message = re.sub(r"'?<[\w.]+ object at 0x[0-9a-f]+>'?", "the content", str(error))
    return f"{type(error).__name__}: {' '.join(message.split())}"
