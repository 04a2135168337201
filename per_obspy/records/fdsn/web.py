"""Answers of web services: requested again when a fault may pass, else refused in one line."""

from collections.abc import Mapping
from urllib.parse import urlsplit

import urllib3

from per_obspy.errors import ServiceError

#: faults that may pass: too many requests, and all faults on the side of the service
PASSING_FAULTS = (429, 500, 502, 503, 504)

#: longest pause before the next attempt, s, even if a service demands a longer one
LONGEST_WAIT = 600

_NO_CONTENT, _NOT_FOUND, _TOO_LARGE, _URI_TOO_LONG = 204, 404, 413, 414


class NotFound(ServiceError):
    """A service does not have the subject of a request, or does not exist (404)."""


class RequestTooLarge(ServiceError):
    """A service refuses to answer that much at once."""


def web_pool(timeout: float, retries: int, wait: float) -> urllib3.PoolManager:
    """
    Return a pool of connections.

    Parameters
    ----------
    timeout : float
        Longest wait for an answer, or for more of it, s.
    retries : int
        Number of further attempts after time-outs, cut answers, 429 and 5xx. A ``Retry-After`` of
        the service counts.
    wait : float
        Unit of the pauses, s: wait * 2^(n-1) after the n-th failed attempt, none after the first.
    """
    patience = urllib3.Retry(
        retries,
        redirect=5,
        status_forcelist=PASSING_FAULTS,
        backoff_factor=wait,
        backoff_max=LONGEST_WAIT,
        retry_after_max=LONGEST_WAIT,
        raise_on_status=False,
    )
    return urllib3.PoolManager(
        retries=patience, timeout=timeout, maxsize=16, headers={"User-Agent": "per_obspy"}
    )


def answer(pool: urllib3.PoolManager, url: str, parameters: Mapping[str, str]) -> bytes:
    """
    Return the whole answer of a service; empty if it has no data (204).

    Raises
    ------
    NotFound
        404, which FDSN services do not use for "no data" unless a request demands it.
    RequestTooLarge
        If the request must be divided (413, 414).
    ServiceError
        If there is no answer, or it is another fault.
    """
    try:
        response = pool.request("GET", url, fields=dict(parameters))
    except (urllib3.exceptions.HTTPError, ValueError) as error:
        cause = getattr(error, "reason", None) or error
        raise ServiceError(f"{url}: no answer: {_one_line(str(cause))}") from error
    # 204 is an answer, all else but 200 a fault
    if response.status == _NO_CONTENT:
        return b""
    if response.status == _NOT_FOUND:
        raise NotFound(f"{url}: not found (HTTP 404)")
    if response.status in (_TOO_LARGE, _URI_TOO_LONG):
        raise RequestTooLarge(f"{url}: refuses to answer so much at once (HTTP {response.status})")
    if response.status != 200:
        page = response.data.decode("utf-8", "replace")
        raise ServiceError(f"{url}: HTTP {response.status}: {_one_line(page)}")
    return bytes(response.data)


def host(url: str) -> str:
    """
    Return the part of a URL that names the service.

    >>> host("https://service.scedc.caltech.edu/fdsnws/station/1/query")
    'service.scedc.caltech.edu'
    """
    return urlsplit(url).netloc


def _one_line(text: str) -> str:
    """Return at most 200 characters of a text on one line."""
    return f"{' '.join(text.split()):.200}"
