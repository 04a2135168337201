"""
Answers of web services, bounded in time and size.

A request is repeated when its fault may pass, else refused in one line.
"""

import math
import re
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from types import MappingProxyType
from typing import NamedTuple
from urllib.parse import unquote, urljoin, urlsplit, urlunsplit

import urllib3

from per_obspy.errors import ServiceError
from per_obspy.names import public_url

#: faults that may pass: too many requests, and all faults on the side of the service
PASSING_FAULTS = (429, 500, 502, 503, 504)

#: longest pause before the next attempt, s, even if a service demands a longer one
LONGEST_WAIT = 600

#: Default limits of one answer: s, and bytes after unpacking.
LONGEST_ANSWER, LARGEST_ANSWER = 600.0, 256 * 2**20

_NO_CONTENT, _NOT_FOUND, _TOO_LARGE, _URI_TOO_LONG = 204, 404, 413, 414

#: Answers of event services to the identifier of a deleted earthquake.
_DELETED = (409, 410)

_REDIRECTIONS, _MOST_REDIRECTIONS = (301, 302, 303, 307, 308), 5

#: Bytes that are read at once, and of a page that explains an error.
_PIECE, _PAGE = 2**16, 2**12


class NotFound(ServiceError):
    """A service lacks or has deleted a subject, or does not exist (404, 409, 410)."""


class RequestTooLarge(ServiceError):
    """A service refuses to answer that much at once."""


class EmptyAnswer(ServiceError):
    """A service answers 200 without content; where it has no data it should answer 204."""


class PassingFault(ServiceError):
    """A fault that may pass, with the pause in s that the service demands, None if it does not."""

    def __init__(self, message: str, pause: float | None = None) -> None:
        super().__init__(message)
        self.pause = pause


class WebPool(NamedTuple):
    """
    Connections to services, and patience with them; see :func:`web_pool`.

    Attributes
    ----------
    connections : urllib3.PoolManager
    retries : int
    wait : float
        s.
    longest : float
        s.
    largest : int
        Bytes.
    longest_pause : float
        s; a service that demands a longer pause is given up at once.
    resting : mapping
        Host -> s for which it is not asked, as it has demanded earlier.
    demanded : dict or None
        Collects the hosts that are given up and the pause that each demands, s.
    """

    connections: urllib3.PoolManager
    retries: int
    wait: float
    longest: float
    largest: int
    longest_pause: float = math.inf
    resting: Mapping[str, float] = MappingProxyType({})
    demanded: dict[str, float] | None = None


class Answer(NamedTuple):
    """
    An answer of a service.

    Attributes
    ----------
    content : bytes
        Empty if there are no data (204).
    is_framed : bool
        Whether the service announced where the answer ends, so that a cut would have been seen.
    """

    content: bytes
    is_framed: bool


def web_pool(
    timeout: float,
    retries: int,
    wait: float,
    longest: float = LONGEST_ANSWER,
    largest: int = LARGEST_ANSWER,
) -> WebPool:
    """
    Return a pool of connections.

    Parameters
    ----------
    timeout : float
        Longest wait for an answer, or for more of it, s.
    retries : int
        Number of further attempts after time-outs, cut answers, 429 and 5xx. A ``Retry-After`` of
        the service counts. Redirections are followed apart from them.
    wait : float
        Unit of the pauses, s: wait * 2^(n-1) after the n-th failed attempt, none after the first.
    longest : float
        Longest time of one attempt in all, s.
    largest : int
        Largest answer, bytes after unpacking.
    """
    connections = urllib3.PoolManager(
        retries=False, timeout=timeout, maxsize=16, headers={"User-Agent": "per_obspy"}
    )
    return WebPool(connections, retries, wait, longest, largest)


def answer(pool: WebPool, url: str, parameters: Mapping[str, str]) -> bytes:
    """Return the content of :func:`whole_answer`."""
    return whole_answer(pool, url, parameters).content


def whole_answer(pool: WebPool, url: str, parameters: Mapping[str, str]) -> Answer:
    """
    Return the whole answer of a service; empty if it has no data (204).

    Raises
    ------
    NotFound
        404, which FDSN services do not use for "no data" unless a request demands it.
    RequestTooLarge
        If the request must be divided (413, 414).
    EmptyAnswer
        200 without content, which may be a fault: it is no proof that there are no data.
    ServiceError
        If there is no answer, it takes too long or is too large, or it is another fault.
    """
    if rest := pool.resting.get(host(url)):
        reason = f"is not asked for another {rest:.0f} s, as it demanded by Retry-After"
        raise PassingFault(f"{public_url(url)}: {reason}", rest)
    for attempt in range(1, pool.retries + 2):
        try:
            return _within(pool, url, lambda: _attempt(pool, url, parameters))
        except PassingFault as fault:
            if attempt > pool.retries or (fault.pause or 0.0) > pool.longest_pause:
                _note_demand(pool, url, fault)
                raise
            time.sleep(_pause(pool.wait, attempt, fault.pause))
    raise AssertionError  # the last attempt returns or raises


def _note_demand(pool: WebPool, url: str, fault: PassingFault) -> None:
    """Collect the pause that a service demands, the longest of each host."""
    if pool.demanded is not None and fault.pause:
        name = host(url)
        pool.demanded[name] = max(pool.demanded.get(name, 0.0), fault.pause)


def _pause(wait: float, attempt: int, demanded: float | None) -> float:
    """Return the time before the next attempt, s."""
    usual = wait * 2.0 ** min(attempt - 1, 60) if attempt > 1 else 0.0
    return min(max(usual if demanded is None else demanded, 0.0), LONGEST_WAIT)


def _within(pool: WebPool, url: str, work: Callable[[], Answer]) -> Answer:
    """Return the result of some work, or raise its error or one that it takes too long."""
    results, errors = list[Answer](), list[Exception]()

    def do() -> None:
        try:
            results.append(work())
        except Exception as error:  # noqa: BLE001 - raised again below
            errors.append(error)

    # A service can keep a connection busy at every step; the thread of such a one is left behind
    thread = threading.Thread(target=do, daemon=True)
    thread.start()
    thread.join(pool.longest)
    for error in errors:
        raise error
    if not results:
        raise ServiceError(f"{public_url(url)}: no whole answer within {pool.longest:g} s")
    return results[0]


def _attempt(pool: WebPool, url: str, parameters: Mapping[str, str]) -> Answer:
    """Return the answer of one attempt; redirections are followed."""
    shown, until = public_url(url), time.monotonic() + pool.longest
    try:
        response = _redirected(pool, url, parameters)
        try:
            return _read(pool, response, shown, until)
        finally:
            # The rest of an answer is not read
            response.close()
    except urllib3.exceptions.LocationValueError as error:
        raise ServiceError(f"{shown}: is no address") from error
    except (urllib3.exceptions.HTTPError, ValueError) as error:
        cause = getattr(error, "reason", None) or error
        raise PassingFault(f"{shown}: no answer: {_one_line(str(cause))}") from error


def _redirected(pool: WebPool, url: str, parameters: Mapping[str, str]) -> urllib3.BaseHTTPResponse:
    """Return the response at the end of the redirections."""
    fields: dict[str, str] | None = dict(parameters)
    target = url
    # Each step is a separate request, apart from the retries
    for _ in range(_MOST_REDIRECTIONS + 1):
        address, headers = _address(pool, target, url)
        response = pool.connections.request(
            "GET",
            address,
            fields=fields,
            headers=headers,
            preload_content=False,
            redirect=False,
        )
        place = response.headers.get("Location")
        if response.status not in _REDIRECTIONS or not place:
            return response
        response.close()
        # The new place has the parameters of the request in it, if it wants them
        target, fields = urljoin(target, place), None
        if urlsplit(target).scheme != urlsplit(url).scheme:
            reason = f"redirects to another scheme, {public_url(target)}: give that address"
            raise ServiceError(f"{public_url(url)}: {reason}")
    raise ServiceError(f"{public_url(url)}: redirects more than {_MOST_REDIRECTIONS} times")


def _address(pool: WebPool, target: str, url: str) -> tuple[str, dict[str, str]]:
    """Return an address without user and password, and the headers that hold them instead."""
    parts, headers = urlsplit(target), dict(pool.connections.headers)
    user, _, place = parts.netloc.rpartition("@")
    # Only the host that the user named learns the password
    if urlsplit(url).hostname == parts.hostname:
        user = user or urlsplit(url).netloc.rpartition("@")[0]
        headers |= urllib3.make_headers(basic_auth=unquote(user)) if user else {}
    return urlunsplit(parts._replace(netloc=place)), headers


def _read(pool: WebPool, response: urllib3.BaseHTTPResponse, shown: str, until: float) -> Answer:
    """Return the content of a response; its status may be an error."""
    # 204 is an answer, all else but 200 a fault
    if response.status == _NO_CONTENT:
        return Answer(b"", is_framed=True)
    if response.status != 200:
        raise _refusal(response, shown)
    # Piece by piece, so that a slow or endless answer ends at the limits
    content = bytearray()
    while piece := response.read1(_PIECE):
        content += piece
        if len(content) > pool.largest:
            raise ServiceError(f"{shown}: the answer is larger than {pool.largest} bytes")
        if time.monotonic() > until:
            raise ServiceError(f"{shown}: no whole answer within {pool.longest:g} s")
    if not content or content.isspace():
        reason = 'an empty answer (HTTP 200), which is not "no data" (HTTP 204)'
        raise EmptyAnswer(f"{shown}: {reason}: asked again later")
    names = {name.lower() for name in response.headers}
    is_framed = bool(names & {"content-length", "transfer-encoding"})
    return Answer(bytes(content), is_framed)


def _refusal(response: urllib3.BaseHTTPResponse, shown: str) -> ServiceError:
    """Return the error of a response whose status is one."""
    if response.status in (_NOT_FOUND, *_DELETED):
        kind = "not found" if response.status == _NOT_FOUND else "deleted"
        return NotFound(f"{shown}: {kind} (HTTP {response.status})")
    if response.status in (_TOO_LARGE, _URI_TOO_LONG):
        problem = f"refuses to answer so much at once (HTTP {response.status})"
        return RequestTooLarge(f"{shown}: {problem}")
    # The page of the service may name the reason
    page = _one_line(response.read1(_PAGE).decode("utf-8", "replace"))
    message = f"{shown}: HTTP {response.status}: {page}"
    if response.status in PASSING_FAULTS:
        return PassingFault(message, _demanded_pause(response.headers.get("Retry-After")))
    return ServiceError(message)


def _demanded_pause(header: str | None) -> float | None:
    """
    Return the pause of a ``Retry-After``, s or a date; None if it is neither.

    >>> _demanded_pause("7"), _demanded_pause("soon"), _demanded_pause(None)
    (7.0, None, None)
    """
    if header is None:
        return None
    if re.fullmatch(r"\s*[0-9]{1,9}\s*", header):
        return float(header)
    with suppress(ValueError, TypeError, OverflowError):
        moment = parsedate_to_datetime(header[:100])
        moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
        return (moment - datetime.now(UTC)).total_seconds()
    return None


def host(url: str) -> str:
    """
    Return the part of a URL that names the service.

    >>> host("https://me:secret@service.scedc.caltech.edu/fdsnws/station/1/query")
    'service.scedc.caltech.edu'
    """
    return urlsplit(public_url(url)).netloc


def _one_line(text: str) -> str:
    """Return at most 200 characters of a text on one line."""
    return f"{' '.join(text.split()):.200}"
