"""
ShakeMap of an earthquake: the files of one version, as the catalogue of the USGS lists them.

The GeoJSON of an event (https://earthquake.usgs.gov/earthquakes/feed/v1.0/geojson_detail.php) names
its products and their files. Other event services list no products. ``shakemap.json`` in a cache
is the status file of the version that was fetched last.
"""

import json
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from per_obspy.errors import CatalogError, ServiceError
from per_obspy.files import file_hash, written_whole
from per_obspy.names import public_url
from per_obspy.records.earthquakes.services import event_url
from per_obspy.records.fdsn.request import digest
from per_obspy.records.fdsn.web import NotFound, WebPool, answer, host
from per_obspy.records.shakemap import read_shakemap
from per_obspy.records.station_list import read_station_list
from per_obspy.resume import (
    Status,
    StatusError,
    changed_outputs,
    earlier_status,
    read_status,
    write_status,
)

log = logging.getLogger(__name__)

#: File of the product -> name here. Without the first there is no map.
GRID, UNCERTAINTY, STATIONS = "grid.xml", "uncertainty.xml", "stationlist.json"
_FILES = {f"download/{name}": name for name in (GRID, UNCERTAINTY, STATIONS)}

#: Status file of the latest map of a cache.
STATUS = "shakemap.json"


class ShakeMapFiles(NamedTuple):
    """Files of one version of a ShakeMap, and the hash of each by its path in the cache."""

    version: str
    grid: Path
    uncertainty: Path | None
    stations: Path | None
    hashes: Mapping[str, str]


def cached_shakemap(
    folder: Path, event_id: str, version: str | None = None
) -> ShakeMapFiles | None:
    """Return the map that `fetch_shakemap` fetched last, if these were its arguments."""
    try:
        status = read_status(folder / STATUS)
    except StatusError:
        return None
    is_other = (status.get("event_id"), status.get("asked")) != (event_id, version)
    return None if is_other or changed_outputs(folder / STATUS, status) else _files(folder, status)


def _files(folder: Path, status: Status) -> ShakeMapFiles:
    """Return the files that a status names."""
    paths = {Path(name).name: folder / name for name in status["outputs"]}
    optional = (paths.get(UNCERTAINTY), paths.get(STATIONS))
    return ShakeMapFiles(str(status["version"]), paths[GRID], *optional, status["outputs"])


def fetch_shakemap(
    pool: WebPool, provider: str, event_id: str, folder: Path, version: str | None = None
) -> ShakeMapFiles | None:
    """
    Fetch the ShakeMap of an earthquake.

    Parameters
    ----------
    pool : WebPool
        Connections and patience.
    provider : str
        Event service that lists products: that of the USGS, or one shaped like it.
    event_id : str
        As the service names it.
    folder : Path
        Gets ``shakemap-VERSION`` with the files; those that it has are not fetched again.
    version : str, optional
        Number of the wanted version; by default the preferred one.

    Returns
    -------
    ShakeMapFiles or None
        None where the service has no map of this event yet.

    Raises
    ------
    CatalogError
        If the version does not exist; the message names those that do.
    ServiceError
        If the service does not answer, or with something else.
    """
    url = event_url(provider)
    chosen = _chosen(pool, url, event_id, version)
    if chosen is None:
        return None
    number = _version(chosen)
    addresses = {name: _address(chosen, member) for member, name in _FILES.items()}
    if not addresses[GRID]:
        raise ServiceError(f"{public_url(url)}: version {number} of the ShakeMap has no {GRID}")
    # The addresses of a file change with its content
    key = digest((event_id, version, number, chosen["updateTime"], addresses))
    if status := earlier_status(folder / STATUS, key):
        return _files(folder, status)
    # Versions stand beside each other
    place = folder / f"shakemap-{number}"
    files = _download(pool, url, addresses, place)
    hashes = {f"{place.name}/{name}": file_hash(file) for name, file in files.items()}
    facts = {"event_id": event_id, "asked": version, "version": number}
    return _files(folder, write_status(folder / STATUS, key, hashes, facts))


def _download(
    pool: WebPool, url: str, addresses: Mapping[str, str], place: Path
) -> dict[str, Path]:
    """Fetch the files of a map into a folder; what is kept can be read."""
    place.mkdir(parents=True, exist_ok=True)
    files = {
        name: _fetched(pool, url, address, place / name)
        for name, address in addresses.items()
        if address
    }
    # A damaged grid is asked for again
    try:
        read_shakemap(files[GRID], files.get(UNCERTAINTY))
    except CatalogError as error:
        files[GRID].unlink()
        raise ServiceError(
            f"{public_url(url)}: its ShakeMap is damaged: {error.problem}"
        ) from error
    # The map serves without its stations
    if STATIONS in files:
        try:
            read_station_list(files[STATIONS])
        except CatalogError as error:
            files.pop(STATIONS).unlink()
            log.warning("%s: left out: %s", public_url(url), error)
    return files


def _chosen(
    pool: WebPool, url: str, event_id: str, version: str | None
) -> Mapping[str, Any] | None:
    """Return the map of a version, or the preferred one; None if there is no map."""
    # Earlier versions are listed on demand
    wanted = {} if version is None else {"includesuperseded": "true"}
    try:
        content = answer(pool, url, {"eventid": event_id, "format": "geojson", **wanted})
    except NotFound:
        return None
    maps = _maps(url, content)
    if not maps or version is None:
        return maps[0] if maps else None
    versions: dict[str, Mapping[str, Any]] = {_version(one): one for one in reversed(maps)}
    if version not in versions:
        listed = ", ".join(sorted(versions, key=int))
        problem = f"has no version {version} of the ShakeMap, only {listed}"
        raise CatalogError(public_url(url), problem)
    return versions[version]


def _maps(url: str, content: bytes) -> list[Mapping[str, Any]]:
    """Return the maps of an answer, the preferred and latest first, without deleted ones."""
    try:
        products = json.loads(content)["properties"]["products"] if content else {}
        maps = [one for one in products.get("shakemap", ()) if one["status"] != "DELETE"]
        # A network of the region may prefer its own
        return sorted(maps, key=lambda one: (one["preferredWeight"], one["updateTime"]))[::-1]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        reason = f"answers with data other than the event: {type(error).__name__} {error}"
        raise ServiceError(f"{public_url(url)}: {reason}") from error


def _version(product: Mapping[str, Any]) -> str:
    """Return the number of a map's version; digits alone, because it names a folder."""
    number = str(product.get("properties", {}).get("version", ""))
    return number if number.isdecimal() and len(number) < 6 else "0"


def _address(product: Mapping[str, Any], member: str) -> str:
    """Return the address of a file of a product, empty if it has none."""
    contents = product.get("contents")
    entry = contents.get(member) if isinstance(contents, dict) else None
    address = entry.get("url") if isinstance(entry, dict) else None
    return address if isinstance(address, str) else ""


def _fetched(pool: WebPool, url: str, address: str, path: Path) -> Path:
    """Return a file of a product; it comes from the service itself, not from where it may point."""
    if host(address) != host(url):
        raise ServiceError(
            f"{public_url(url)}: names a file of another host: {public_url(address)}"
        )
    content = answer(pool, address, {})
    with written_whole(path) as part:
        part.write_bytes(content)
    return path
