"""
Names from data: codes of stations, paths that must lie in their folder, public addresses.

And numbers of things in words.
"""

import re
from pathlib import Path

from per_obspy.errors import CatalogError, shortened

#: Codes of a trace in their order.
_CODES = ("network", "station", "location", "channel")

#: Letters of a code: those of SEED, and lower case and the underscore, which agencies use.
_CODE = re.compile(r"[A-Za-z0-9_-]*")

#: Longest code, letters: with all that is put around it, it still is the name of a file.
LONGEST_CODE = 64

#: Letters of a wrong name that a message has.
SHOWN = 80

#: Longest name of a file on usual file systems, and longest path inside a folder, bytes.
_LONGEST_NAME, _LONGEST_PATH = 255, 1024

#: Control characters, folders of Windows, or a drive of Windows at the start.
_UNPORTABLE = re.compile(r"[\x00-\x1f\x7f-\x9f\\]|^[A-Za-z]:")


def number_of(count: int, thing: str) -> str:
    """
    Return a number of things in words.

    Examples
    --------
    >>> number_of(1, "pair"), number_of(0, "pair")
    ('1 pair', '0 pairs')
    """
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def code_problem(*codes: str) -> str:
    """
    Return the reason why codes from data cannot name a file; empty if they can.

    Parameters
    ----------
    *codes : str
        Of network and station, and of location and channel; any may be empty.

    Examples
    --------
    >>> code_problem("BO", "AOM001"), code_problem("", "TAFT", "", "HN1")
    ('', '')
    >>> code_problem("XX", "../victim")
    "station code '../victim': expected letters, digits, - and _ only"
    """
    # Length first: a long text is neither searched nor shown
    for kind, code in zip(_CODES, codes, strict=False):
        if len(code) > LONGEST_CODE:
            problem = f"has {len(code)} letters, expected {LONGEST_CODE} or fewer"
            return f"{kind} code {shortened(code, SHOWN)!r} {problem}"
        if not _CODE.fullmatch(code):
            return f"{kind} code {shortened(code, SHOWN)!r}: expected letters, digits, - and _ only"
    return "" if len(codes) > 1 else f"{shortened('.'.join(codes), SHOWN)!r}: expected NET.STA"


def inside(folder: Path, name: str) -> Path:
    """
    Return the path of a file in a folder by a name made from data.

    Links are followed: the file, or where it would be, must lie in the folder.

    Parameters
    ----------
    folder : Path
        The file, which need not exist yet.
    name : str
        Path seen from the folder, with ``/`` between folders.

    Raises
    ------
    CatalogError
        If the name leads out of the folder or is none on every system.

    Examples
    --------
    >>> inside(Path("stations"), "CI.CLC.nc").name
    'CI.CLC.nc'
    >>> inside(Path("stations"), "../CI.CLC.nc")
    Traceback (most recent call last):
        ...
    per_obspy.errors.CatalogError: stations: '../CI.CLC.nc' leads out of this folder
    """
    if problem := name_problem(name):
        raise CatalogError(str(folder), f"{shortened(name, SHOWN)!r} {problem}")
    # Links inside the folder may lead elsewhere
    path, base = folder / name, folder.resolve()
    if not path.resolve().is_relative_to(base) or path.resolve() == base:
        raise CatalogError(str(folder), f"{shortened(name, SHOWN)!r} leads out of this folder")
    return path


def name_problem(name: str) -> str:
    """
    Return the reason why a name from data is none of a file inside a folder; empty if it is one.

    Parameters
    ----------
    name : str
        With ``/`` between folders.

    Examples
    --------
    >>> name_problem("2019/CI.CLC.mseed"), name_problem("/etc/passwd")
    ('', 'leads out of this folder')
    """
    parts = name.split("/")
    if _UNPORTABLE.search(name):
        return "is no name of a file on every system"
    # No system takes a longer one
    longest = max(len(part.encode("utf-8", "surrogatepass")) for part in parts)
    if longest > _LONGEST_NAME or len(name) > _LONGEST_PATH:
        return f"is longer than {_LONGEST_NAME} bytes, or {_LONGEST_PATH} with its folders"
    # An absolute name has an empty first part
    return "leads out of this folder" if {"", ".", ".."} & set(parts) else ""


def public_url(address: str) -> str:
    """
    Return an address without user, password, query and fragment; other text as it is.

    Examples
    --------
    >>> public_url("https://me:secret@example.org:8080/query?token=secret")
    'https://example.org:8080/query'
    >>> public_url("USGS")
    'USGS'
    """
    scheme, separator, rest = address.partition("://")
    if not separator:
        return address
    # A password may hold any letter, even / and ?
    place = rest.rpartition("@")[2]
    return f"{scheme}://{re.split('[?#]', place, maxsplit=1)[0]}"
