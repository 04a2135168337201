"""
Answers of web services, bounded in time and size.

A request is repeated when its fault may pass, else refused in one line.
"""

import math
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from urllib.parse import unquote, urljoin, urlsplit, urlunsplit

import urllib3
from urllib3.exceptions import HTTPError, InvalidHeader, LocationValueError

from per_obspy.errors import ServiceError
from per_obspy.names import public_url

#: Faults that may pass: too many requests, and all faults on the side of the service.
PASSING_FAULTS = (429, 500, 502, 503, 504)

#: Longest pause before the next attempt, s, even if a service demands a longer one.
LONGEST_WAIT = 600

#: Default limits of one answer: s, and bytes after unpacking.
LONGEST_ANSWER, LARGEST_ANSWER = 600.0, 256 * 2**20

_NO_CONTENT, _NOT_FOUND = 204, 404

#: Answers to a request that must be divided, and of event services to a deleted earthquake.
_TOO_LARGE, _DELETED = (413, 414), (409, 410)

_MOST_REDIRECTIONS = 5

#: Bytes that are read at once, and of a page that explains an error.
_PIECE, _PAGE = 2**16, 2**12

#: Times that an answer without an announced end is compared with the next.
_COMPARISONS = 3


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


@dataclass(frozen=True)
class WebPool:
    """
    Connections to services, and patience with them.

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
    longest_pause : float
        s; a service that demands a longer pause is given up at once.
    resting : mapping
        Host -> s for which it is not asked, as it has demanded earlier.
    demanded : dict or None
        Collects the hosts that are given up and the pause that each demands, s.
    """

    timeout: float
    retries: int
    wait: float
    longest: float = LONGEST_ANSWER
    largest: int = LARGEST_ANSWER
    longest_pause: float = math.inf
    resting: Mapping[str, float] = field(default_factory=dict)
    demanded: dict[str, float] | None = None

    @cached_property
    def connections(self) -> urllib3.PoolManager:
        """Connections, which are kept for further requests."""
        agent = {"User-Agent": "per_obspy"}
        return urllib3.PoolManager(retries=False, timeout=self.timeout, maxsize=16, headers=agent)


#: Content of an answer, empty if there are no data (204), and whether the service announced where
#: the answer ends, so that a cut would have been seen.
Answer = tuple[bytes, bool]


def answer(pool: WebPool, url: str, parameters: Mapping[str, str]) -> bytes:
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
    return _patient_answer(pool, url, parameters)[0]


def steady_answer(pool: WebPool, url: str, parameters: Mapping[str, str]) -> bytes:
    """Return an answer whose end the service announced, or that is the same a second time."""
    before = None
    # Where no length is announced, a connection that breaks looks like the end
    for _ in range(_COMPARISONS + 1):
        content, is_framed = _patient_answer(pool, url, parameters)
        if is_framed or content == before:
            return content
        before = content
    raise ServiceError(f"{public_url(url)}: its answers are cut at different places")


def _patient_answer(pool: WebPool, url: str, parameters: Mapping[str, str]) -> Answer:
    """Return the answer of the first attempt without a fault that may pass."""
    if rest := pool.resting.get(host(url)):
        reason = f"is not asked for another {rest:.0f} s, as it demanded by Retry-After"
        raise PassingFault(f"{public_url(url)}: {reason}", rest)
    retry = urllib3.Retry(pool.retries, backoff_factor=pool.wait, backoff_max=LONGEST_WAIT)
    while True:
        try:
            return _timely_answer(pool, url, parameters)
        except PassingFault as fault:
            # After the last attempt, or where the service wants to be left alone for long
            demanded = fault.pause or 0.0
            if not retry.total or demanded > pool.longest_pause:
                # The longest pause that the host demands
                if pool.demanded is not None and demanded:
                    known = pool.demanded.get(host(url), 0.0)
                    pool.demanded[host(url)] = max(known, demanded)
                raise
            retry = retry.increment("GET", url, error=fault)
            pause = retry.get_backoff_time() if fault.pause is None else fault.pause
            time.sleep(min(pause, LONGEST_WAIT))


def _timely_answer(pool: WebPool, url: str, parameters: Mapping[str, str]) -> Answer:
    """Return the answer of one attempt, or raise its error or one that it takes too long."""
    outcome = list[Answer | OSError | MemoryError]()

    def attempt() -> None:
        # All errors of services are errors of the operating system too
        try:
            outcome.append(_attempt(pool, url, parameters))
        except (OSError, MemoryError) as error:
            outcome.append(error)

    # A service can keep a connection busy at every step; the thread of such a one is left behind
    thread = threading.Thread(target=attempt, daemon=True)
    thread.start()
    thread.join(pool.longest)
    if thread.is_alive():
        raise ServiceError(f"{public_url(url)}: no whole answer within {pool.longest:g} s")
    (result,) = outcome
    if isinstance(result, BaseException):
        raise result
    return result


def _attempt(pool: WebPool, url: str, parameters: Mapping[str, str]) -> Answer:
    """Return the answer of one attempt; redirections are followed."""
    shown, until = public_url(url), time.monotonic() + pool.longest
    try:
        # The rest of an answer is not read
        with _redirected(pool, url, parameters) as response:
            return _read(pool, response, shown, until)
    except LocationValueError as error:
        raise ServiceError(f"{shown}: is no address") from error
    except (HTTPError, ValueError) as error:
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
        place = response.get_redirect_location()
        if not place:
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
        return b"", True
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
    is_framed = "Content-Length" in response.headers or "Transfer-Encoding" in response.headers
    return bytes(content), is_framed


def _refusal(response: urllib3.BaseHTTPResponse, shown: str) -> ServiceError:
    """Return the error of a response whose status is one."""
    status = f"(HTTP {response.status})"
    if response.status == _NOT_FOUND:
        return NotFound(f"{shown}: not found {status}")
    if response.status in _DELETED:
        return NotFound(f"{shown}: deleted {status}")
    if response.status in _TOO_LARGE:
        return RequestTooLarge(f"{shown}: refuses to answer so much at once {status}")
    # The page of the service may name the reason
    page = _one_line(response.read1(_PAGE).decode("utf-8", "replace"))
    message = f"{shown}: HTTP {response.status}: {page}"
    if response.status in PASSING_FAULTS:
        return PassingFault(message, _demanded_pause(response.headers.get("Retry-After", "")))
    return ServiceError(message)


def _demanded_pause(header: str) -> float | None:
    """
    Return the pause of a ``Retry-After``, s or a date; None if it is neither.

    >>> _demanded_pause("7"), _demanded_pause("soon"), _demanded_pause("9" * 10)
    (7, None, None)
    """
    # Thirty years are no pause
    if len(header) > 9 and header.strip().isdigit():
        return None
    with suppress(InvalidHeader, ValueError, TypeError, OverflowError):
        return urllib3.Retry().parse_retry_after(header[:100])
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
