"""Every entry of files from outside: a sample of the file and its reader."""

import gzip
import io
import json
import socket
import sqlite3
import tarfile
import threading
import zipfile
from collections.abc import Callable, Iterable
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import netCDF4
import numpy as np
import obspy
import pandas as pd
import pyogrio
import shapely
from building_samples import (
    Town,
    google,
    microsoft,
    osm_xml,
    overture,
    plateau_lod0,
    plateau_lod1,
    r2d_assets,
    small_town,
)
from format_samples import SAMPLES
from messy_tables import (
    NAMES,
    ROWS,
    readable,
    text_of,
    with_shared_texts,
    workbook_of,
)
from obspy import Stream
from obspy.core.event import Catalog, Event, Magnitude, Origin
from old_workbooks import workbook_of_kind
from station_files import START, THREE, inventory, record

from per_obspy import config
from per_obspy.errors import PerError
from per_obspy.inventory.catalogue import stored_inventories
from per_obspy.inventory.files.reading import read_pairs
from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.records.asdf import find_asdf_stations, read_asdf_station
from per_obspy.records.earthquakes.quakeml import read_event
from per_obspy.records.earthquakes.services import find_events
from per_obspy.records.fdsn.web import WebPool
from per_obspy.records.folder import find_stations, read_station
from per_obspy.records.obspy_readers import read_bytes_with_obspy
from per_obspy.records.processed_files import write_description, write_processed
from per_obspy.records.seedlink import ServerAddress, seedlink_window
from per_obspy.records.shakemap import read_shakemap
from per_obspy.screening.design import read_design_spectrum

#: Small files of other formats among the test data of ObsPy.
OBSPY_FORMATS = {
    "AH": "ah/tests/data/TSG/BRV.TSG.KSM.sE12.resp",
    "GCF": "gcf/tests/data/20160603_1910n.gcf",
    "PDAS": "pdas/tests/data/p1246001.108",
    "REFTEK130": "reftek/tests/data/221935615_00000000",
    "SACXY": "sac/tests/data/testxy.sac",
    "SEISAN": "seisan/tests/data/2011-09-06-1311-36S.A1032_001BH_Z",
    "SH_ASC": "sh/tests/data/TEST_090101_0101.ASC",
    "SLIST": "ascii/tests/data/slist_float.ascii",
    "TSPAIR": "ascii/tests/data/tspair_float.ascii",
    "WIN": "win/tests/data/25112618_ch0000.24bits",
}
#: Formats of ObsPy that are left out: such files are refused, and the record beside them is read.
LEFT_OUT = {
    "ALSEP_WTH": "alsep/tests/data/wth.5.6.mini",
    "RG16": "rg16/tests/data/one_channel_many_traces.fcnt",
    "SEG2": "seg2/tests/data/20180307_031245000.0.seg2",
    "SEGY": "segy/tests/data/example.y_first_trace",
    "WAV": "wav/tests/data/3cssan.near.8.1.RNON.wav",
}
KNET = "nied/tests/data/test.knet"

STATIONS = b"network,station,latitude,longitude,elevation\nCI,CLC,35.0,-117.0,700\n"

ITACA = (
    b"event.ev_sourcedb.shortname,event.datetime,event.latitude,event.longitude,"
    b"event.focaldepth,event.pref_mag,station.code,station.sourceid,station.latitude,"
    b"station.longitude,station.altitude,station.vs30,station.ec8\n"
    b"ITACA,2009-04-06 01:32:39,42.3,13.3,8.8,6.3,AQG,2987,42.37,13.33,721,684.8,B\n"
)

CONFIGURATION = b"""
name = "x"
output = "out"
[records]
folder = "records"
[pairs]
file = "pairs.csv"
"""

INDEX = b"""
[[inventory]]
name = "town"
file = "pairs.csv"
bounding_box = [0.3, 0.1, 0.4, 0.2]
crs = "OGC:CRS84"
sha256 = "0000000000000000000000000000000000000000000000000000000000000000"
pairs = 1
source = "a survey"
licence = "CC0-1.0"
date = 2026-11-21
"""

FORM = b"""
decimal = "."
[columns]
gap = "gap"
[units]
gap = "cm"
"""

CURVE = b"period,damping,sd\n0.1,0.05,0.01\n1.0,0.05,0.1\n4.0,0.05,0.4\n"

#: A place of this machine that no layer may ask, and texts that lead there.
FORBIDDEN = socket.create_server(("127.0.0.1", 0))
FORBIDDEN.setblocking(False)
WEB = f"http://127.0.0.1:{FORBIDDEN.getsockname()[1]}"
FOREIGN = {
    "vrt": '<OGRVRTDataSource><OGRVRTLayer name="x"><SrcDataSource>/vsicurl/{}/a.geojson'
    "</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>",
    "gdalg": '{{"type": "gdal_streamed_alg", "command_line":'
    ' "gdal vector pipeline ! read /vsicurl/{}/b.geojson"}}',
    "wfs": "<OGRWFSDataSource><URL>{}/wfs</URL></OGRWFSDataSource>",
    "link": '{{"type": "FeatureCollection", "features": [], "crs": {{"type": "link",'
    ' "properties": {{"href": "{}/a.wkt", "type": "ogcwkt"}}}}}}',
}

#: Return the numbers of a file, which must be finite.
Read = Callable[[Path], Iterable[object]]


class Entry(NamedTuple):
    """
    One kind of file.

    Attributes
    ----------
    file : str
        Name under which the file is read.
    content : callable
        Return the bytes of a sample, which are damaged.
    read : callable
        Reader.
    """

    file: str
    content: Callable[[], bytes]
    read: Read


def entries() -> dict[str, Entry]:
    """Return every kind of file by name."""
    return _text_formats() | _record_files() | _archives() | _metadata() | _inventories() | _plans()


def _text_formats() -> dict[str, Entry]:
    """Return the formats that the package reads itself."""
    return {
        name: Entry("record.txt", partial(_latin, sample.text), _records)
        for name, sample in SAMPLES.items()
    }


def _record_files() -> dict[str, Entry]:
    """Return formats that ObsPy reads, and a workspace."""
    bundled = Path(obspy.__file__).parent / "io"
    files = {
        name: Entry(f"record.{name.lower()}", (bundled / file).read_bytes, partial(_direct, name))
        for name, file in OBSPY_FORMATS.items()
    }
    by_detection = {
        f"{name}_detected": Entry("x.bin", (bundled / file).read_bytes, _record_beside)
        for name, file in (OBSPY_FORMATS | LEFT_OUT).items()
    }
    return (
        files
        | by_detection
        | {
            "mseed": Entry("record.mseed", partial(_written, "MSEED"), _raw_record),
            "mseed3": Entry("record.mseed3", partial(_written, "MSEED3"), _raw_record),
            "sac": Entry("record.sac", partial(_written, "SAC"), _raw_record),
            "knet": Entry("record.knet", (bundled / KNET).read_bytes, _records),
            "asdf": Entry("workspace.h5", _workspace, _asdf),
        }
    )


def _archives() -> dict[str, Entry]:
    """Return archives of two records."""
    return {
        "zip": Entry("all.zip", _zip, _records),
        "zip_in_zip": Entry("bundle.zip", _bundle, _records),
        "tar": Entry("all.tar", partial(_tar, "w"), _records),
        "tgz": Entry("all.tgz", partial(_tar, "w:gz"), _records),
    }


def _metadata() -> dict[str, Entry]:
    """Return the entries for stations, earthquakes and regions."""
    return {
        "stationxml": Entry("station.xml", _station_xml, _records_beside),
        "stations": Entry("stations.csv", lambda: STATIONS, _text_beside),
        "itaca_metadata": Entry("x.metadata", lambda: ITACA, _text_beside),
        "seedlink": Entry("answer.seedlink", _packets, _seedlink),
        "description": Entry("record.json", _description, _described_record),
        "quakeml": Entry("event.xml", _quakeml, _event),
        "event_list": Entry("events.xml", _quakeml, _event_list),
        "geojson_feed": Entry("feed.geojson", _feed, _event_list),
        "shakemap": Entry("grid.xml", _grid, _shakemap),
    }


def _inventories() -> dict[str, Entry]:
    """Return tables of pairs and layers of buildings."""
    return {
        "pairs_csv": Entry("pairs.csv", _pairs_csv, _pairs),
        "pairs_turkish": Entry("pairs.csv", _turkish, _pairs),
        "pairs_utf_16": Entry("pairs.txt", _utf_16, _pairs),
        "pairs_xlsx": Entry("pairs.xlsx", _workbook, _pairs),
        **{
            f"pairs_{suffix}": Entry(f"pairs.{suffix}", partial(_workbook_of, suffix), _pairs)
            for suffix in ("ods", "xlsb", "xls")
        },
        "pairs_form": Entry("pairs.csv.toml", lambda: FORM, _pairs_beside),
        "pairs_parquet": Entry("pairs.parquet", _pairs_parquet, _pairs),
        "footprints_geojson": Entry("town.geojson", partial(_layer, "a.geojson"), _footprints),
        "footprints_gpkg": Entry("town.gpkg", partial(_layer, "a.gpkg"), _footprints),
        "footprints_fgb": Entry("town.fgb", partial(_layer, "a.fgb"), _footprints),
        "footprints_view": Entry("town.gpkg", _view, _footprints),
        "packed_lines": Entry("town.geojsonl.gz", _packed, _footprints),
        **{
            f"foreign_{kind}_{suffix}": Entry(f"town.{suffix}", partial(_foreign, kind), _led)
            for kind in FOREIGN
            for suffix in ("geojson", "gpkg", "shp", "fgb", "osm", "gml")
        },
        "citygml_lod0": Entry("town.gml", partial(_town, plateau_lod0), _footprints),
        "citygml_lod1": Entry("town.gml", partial(_town, plateau_lod1), _footprints),
        "assets": Entry("town.json", partial(_town, r2d_assets), _footprints),
        "google_csv": Entry("town.csv", partial(_town, google), _footprints),
        "geojson_lines": Entry("town.geojsonl", partial(_town, microsoft), _footprints),
        "osm": Entry("town.osm", partial(_town, osm_xml), _footprints),
        "overture": Entry("town.parquet", partial(_town, overture), _footprints),
    }


def _plans() -> dict[str, Entry]:
    """Return configurations, the index of inventories and a design spectrum."""
    return {
        "configuration": Entry("run.toml", lambda: CONFIGURATION, _configuration),
        "index": Entry("index.toml", lambda: INDEX, _index),
        "spectrum": Entry("code.csv", lambda: CURVE, _spectrum),
    }


def _latin(text: str) -> bytes:
    """Return a text as bytes."""
    return text.encode("latin-1")


def _written(form: str) -> bytes:
    """Return a record as ObsPy writes it."""
    trace = record("HN1", (np.sin(np.arange(300) / 9.0) * 1000.0).astype(np.int32))
    with TemporaryDirectory() as folder:
        path = Path(folder, "record")
        trace.write(str(path), format=form)
        return path.read_bytes()


def _members() -> dict[str, bytes]:
    """Return the files of an archive."""
    return {"a.txt": _latin(SAMPLES["csmip_v2"].text), "b.mseed": _written("MSEED")}


def _zip() -> bytes:
    """Return a zip file."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in _members().items():
            archive.writestr(name, content)
    return packed.getvalue()


def _bundle() -> bytes:
    """Return a zip of a zip and a tar, as centres of strong motion pack stations."""
    packed = io.BytesIO()
    # Stored, so that damage reaches the archives inside as well
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("one/station.zip", _zip())
        archive.writestr("two.tar", _tar("w"))
        archive.writestr("README.txt", b"words")
    return packed.getvalue()


def _tar(mode: str) -> bytes:
    """Return a tar file."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode=mode) as archive:  # type: ignore[call-overload]
        for name, content in _members().items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    return packed.getvalue()


def _station_xml() -> bytes:
    """Return the StationXML of three channels."""
    content = io.BytesIO()
    inventory(THREE).write(content, format="STATIONXML")
    return content.getvalue()


def _quakeml() -> bytes:
    """Return one earthquake."""
    origin = Origin(time=START, latitude=35.0, longitude=-117.0, depth=1e4)
    content = io.BytesIO()
    quake = Event(origins=[origin], magnitudes=[Magnitude(mag=6.0)])
    Catalog([quake]).write(content, format="QUAKEML")
    return content.getvalue()


def _processed(folder: Path) -> None:
    """Write a processed record and its JSON."""
    trace = record("HN1")
    place = {"latitude": 35.0, "longitude": -117.0, "elevation": 700.0}
    trace.stats.update({"units": "m/s2", "quantity": "acceleration", "coordinates": place})
    path = folder / "record.mseed"
    write_description(path, write_processed(Stream([trace]), path))


def _description() -> bytes:
    """Return the JSON file of a processed record."""
    with TemporaryDirectory() as folder:
        _processed(Path(folder))
        return Path(folder, "record.json").read_bytes()


def _pair_table() -> pd.DataFrame:
    """Return three pairs with a column of texts."""
    buildings = {"longitude_1": [0.3, 0.4, 0.5], "longitude_2": [0.3001, 0.4001, 0.5001]}
    return pd.DataFrame(
        {
            "pair_id": ["a", "b", "c"],
            **buildings,
            "latitude_1": [0.1, 0.1, 0.1],
            "latitude_2": [0.1, 0.1, 0.1],
            "height_1": [10.0, 20.0, 7.0],
            "height_2": [12.0, 9.0, 7.0],
            "gap": [0.05, 0.0, 0.3],
            "ward": ["old, town", 'the "hill"', ""],
        }
    )


def _pairs_csv() -> bytes:
    """Return a pair table as text."""
    return _pair_table().to_csv(index=False).encode()


def _turkish() -> bytes:
    """Return a pair table with semicolons, decimal commas and Turkish headings."""
    return readable()["Turkish, cp1254, gap in cm"].content


def _utf_16() -> bytes:
    """Return a pair table in UTF-16 with tabulators."""
    return text_of(NAMES, ROWS, "\t", ",").encode("utf-16")


def _workbook_of(suffix: str) -> bytes:
    """Return a workbook of another kind."""
    return workbook_of_kind(f".{suffix}", "Pairs", [NAMES, *ROWS])


def _workbook() -> bytes:
    """Return a pair table in a sheet, with formulas and a part of texts."""
    sheet = [NAMES, *ROWS, ["d", "=1/8|0.125", *ROWS[0][2:]]]
    return with_shared_texts(workbook_of({"Pairs": sheet}))


def _pairs_beside(path: Path) -> Iterable[object]:
    """Read a good pair table with the file as its configured form."""
    table = path.with_suffix("")
    table.write_bytes(_pairs_csv())
    return _pairs(table)


def _pairs_parquet() -> bytes:
    """Return a pair table as Parquet."""
    content = io.BytesIO()
    _pair_table().to_parquet(content)
    return content.getvalue()


def _workspace() -> bytes:
    """Return an ASDF file with one waveform and its StationXML."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "workspace.h5")
        with netCDF4.Dataset(path, "w") as file:
            file.setncattr("file_format", "ASDF")
            file.setncattr("file_format_version", "1.0.3")
            station = file.createGroup("Waveforms").createGroup("CI.CLC")
            text = np.frombuffer(_station_xml(), np.int8)
            station.createDimension("bytes", text.size)
            station.createVariable("StationXML", "i1", ("bytes",))[:] = text
            times = "2020-01-02T03:04:05__2020-01-02T03:04:07"
            name = f"CI.CLC..HN1__{times}__ci1_unprocessed"
            station.createDimension(name, 300)
            samples = station.createVariable(name, "i4", (name,))
            samples[:] = np.arange(300)
            samples.starttime = np.int64(START.ns)
            samples.sampling_rate = 100.0
        return path.read_bytes()


def _feed() -> bytes:
    """Return a list of earthquakes as GeoJSON."""
    facts = {"mag": 6.0, "time": 1577934245000, "place": "a desert", "magType": "mw"}
    place = {"type": "Point", "coordinates": [-117.0, 35.0, 10.0]}
    quake = {"type": "Feature", "id": "x1", "properties": facts, "geometry": place}
    return json.dumps({"type": "FeatureCollection", "features": [quake]}).encode()


def _grid() -> bytes:
    """Return a ShakeMap of four nodes."""
    names = {"LON": "dd", "LAT": "dd", "PSA03": "%g", "PSA10": "%g", "PSA30": "%g"}
    fields = "".join(
        f'<grid_field index="{number}" name="{name}" units="{unit}"/>'
        for number, (name, unit) in enumerate(names.items(), start=1)
    )
    nodes = "0 1 20 10 3\n1 1 20 10 3\n0 0 20 10 3\n1 0 20 10 3\n"
    size = '<grid_specification nlon="2" nlat="2"/>'
    grid = f"{size}{fields}<grid_data>\n{nodes}</grid_data>"
    return f'<shakemap_grid event_id="x">{grid}</shakemap_grid>'.encode()


def _layer(name: str) -> bytes:
    """Return three houses in a row as a layer."""
    houses = [shapely.box(0.1 + 1e-4 * i, 0.1, 0.1 + 1e-4 * i + 9.9e-5, 0.1001) for i in range(3)]
    with TemporaryDirectory() as folder:
        path = Path(folder, name)
        pyogrio.raw.write(
            path,
            geometry=shapely.to_wkb(np.array(houses)),
            field_data=[np.array([12.0, 9.0, 6.0])],
            fields=["height"],
            geometry_type="Polygon",
            crs="EPSG:4326",
        )
        return path.read_bytes()


def _view() -> bytes:
    """Return a GeoPackage with a layer that is a view, and one that is a table."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "a.gpkg")
        path.write_bytes(_layer("a.gpkg"))
        with closing(sqlite3.connect(path)) as package:
            package.execute("CREATE VIEW tall AS SELECT * FROM a WHERE height > 1")
            package.execute(
                "INSERT INTO gpkg_contents (table_name, data_type, identifier, srs_id)"
                " VALUES ('tall', 'features', 'tall', 4326)"
            )
            package.execute(
                "INSERT INTO gpkg_geometry_columns VALUES ('tall', 'geom', 'POLYGON', 4326, 0, 0)"
            )
            package.commit()
        return path.read_bytes()


def _packed() -> bytes:
    """Return four houses as packed lines of GeoJSON."""
    return gzip.compress(_town(microsoft), mtime=0)


def _foreign(kind: str) -> bytes:
    """Return a text that leads elsewhere."""
    return FOREIGN[kind].format(WEB).encode()


def _led(path: Path) -> Iterable[object]:
    """Read a file that is no layer, and fail if that asks for anything."""
    with suppress(PerError):
        pairs_from_footprints(path)
    with suppress(BlockingIOError):
        FORBIDDEN.accept()[0].close()
        raise AssertionError("a layer has asked for something elsewhere")
    return [0.0]


def _town(write: Callable[[Path, Town], Path]) -> bytes:
    """Return four houses in the format of another source."""
    with TemporaryDirectory() as folder:
        return write(Path(folder), small_town()).read_bytes()


def _records(path: Path) -> Iterable[object]:
    """Read a record, or an archive of records, as a run does."""
    found = find_stations(path)
    for name, files in found.stations.items():
        stream, _ = read_station(files, found.inventory, name)
        for trace in stream:
            yield trace.data
            yield trace.stats.delta


def _direct(name: str, path: Path) -> Iterable[object]:
    """Read the bytes of a format, whose units are unknown without a StationXML."""
    stream = read_bytes_with_obspy(obspy.read, path.read_bytes(), str(path), format=name)
    return [len(trace.data) for trace in stream]


def _raw_record(path: Path) -> Iterable[object]:
    """Read raw counts with a good StationXML."""
    path.with_name("station.xml").write_bytes(_station_xml())
    return _records(path.parent)


def _record_beside(path: Path) -> Iterable[object]:
    """Read a good record in a folder with the file."""
    path.with_name("station.xml").write_bytes(_station_xml())
    path.with_name("record.mseed").write_bytes(_written("MSEED"))
    numbers = list(_records(path.parent))
    if not numbers:
        raise AssertionError("the good record beside it is lost")
    # Those of the file itself may be of any kind
    return numbers[:1]


def _text_beside(path: Path) -> Iterable[object]:
    """Read a good record without coordinates, with the file as the table of stations."""
    path.with_name("record.txt").write_bytes(_latin(SAMPLES["itaca"].text))
    return _records(path.parent)


def _described_record(path: Path) -> Iterable[object]:
    """Read a processed record with the file as its JSON."""
    content = path.read_bytes()
    _processed(path.parent)
    path.write_bytes(content)
    return _records(path.parent)


def _records_beside(path: Path) -> Iterable[object]:
    """Read a good record with the file as its metadata."""
    path.with_name("record.mseed").write_bytes(_written("MSEED"))
    return _records(path.parent)


def _asdf(path: Path) -> Iterable[object]:
    """Read a workspace."""
    found = find_asdf_stations(path)
    for name, files in found.stations.items():
        stream, _ = read_asdf_station(files, found.inventory, name)
        for trace in stream:
            yield trace.data


def _event(path: Path) -> Iterable[object]:
    """Read the event of a run."""
    origin = read_event(path).preferred_origin() or read_event(path).origins[0]
    return [origin.latitude, origin.longitude]


def _packets() -> bytes:
    """Return all bytes of a SeedLink server, from its greeting to its end."""
    content = io.BytesIO()
    record("HN1", np.arange(2000, dtype=np.int32) ** 2).write(content, format="MSEED", reclen=512)
    pieces = zip(*[iter(content.getvalue())] * 512, strict=True)
    packets = [b"SL%06X" % number + bytes(piece) for number, piece in enumerate(pieces)]
    return b"SeedLink v3.1\r\nfuzz\r\nOK\r\nOK\r\nOK\r\n" + b"".join(packets) + b"END"


def _seedlink(path: Path) -> Iterable[object]:
    """Read the bytes of a file as the answers of a SeedLink server, and the records in them."""
    pool = WebPool(1.0, 0, 0.01, longest=2.0, largest=2**20)
    channels, window = [("", "HN1")], (START, START + 10.0)
    # Everything is said at once, whatever is asked
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            connection, _ = server.accept()
            with connection, suppress(OSError):
                connection.sendall(path.read_bytes()[:100_000])
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(2**16):
                    pass

        threading.Thread(target=answer, daemon=True).start()
        address = ServerAddress(*server.getsockname())
        content = seedlink_window(pool, address, "CI.CLC", channels, window)
    if not content:
        return []
    stream = read_bytes_with_obspy(obspy.read, content, str(path), format="MSEED")
    return [len(trace.data) for trace in stream]


def _event_list(path: Path) -> Iterable[object]:
    """Read a list of events."""
    return [row.latitude for row in find_events(str(path), {})]


def _shakemap(path: Path) -> Iterable[object]:
    """Read a ShakeMap."""
    return [read_shakemap(path)["psa"].to_numpy()]


def _pairs(path: Path) -> Iterable[object]:
    """Read a pair table; derived columns may be empty."""
    return [read_pairs(path)["gap"].to_numpy()]


def _footprints(path: Path) -> Iterable[object]:
    """Read a layer of buildings."""
    return [pairs_from_footprints(path)["gap"].to_numpy()]


def _configuration(path: Path) -> Iterable[object]:
    """Read the configuration of a run."""
    return [config.load(path, config.Run).records is None]


def _index(path: Path) -> Iterable[object]:
    """Read an index of inventories."""
    return [stored.bounding_box for stored in stored_inventories(path)]


def _spectrum(path: Path) -> Iterable[object]:
    """Read a design spectrum."""
    return [read_design_spectrum(path).sd]
