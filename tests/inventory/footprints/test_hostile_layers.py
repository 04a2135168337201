"""Layers that lead elsewhere, or have no end: no request, no other file, and good ones are read."""

import json
import socket
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
import pyogrio
import pytest
import shapely

from per_obspy.errors import CatalogError
from per_obspy.inventory.footprints.layer_files import read_raw_layer
from per_obspy.inventory.footprints.layers import read_layer
from per_obspy.reader_process import DRIVERS, Limits, read_layer_apart, require_own_drivers

HOUSES = [shapely.box(10 + x * 1e-4, 50, 10.0001 + x * 1e-4, 50.0001) for x in range(3)]

SUFFIXES = (
    *(".geojson", ".json", ".gpkg", ".shp", ".fgb", ".osm", ".pbf", ".gml", ".xml", ".csv"),
    *(".geojsonl", ".parquet", ".csv.gz", ".osm.pbf", ".kml", ".kmz", ".vrt", ".gpx"),
)


@pytest.fixture
def service() -> Iterator[tuple[str, list[bytes]]]:
    """Address of a service of this machine, and the beginnings of all that it was asked."""
    asked: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def listen() -> None:
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                with connection:
                    connection.settimeout(1.0)
                    asked.append(connection.recv(100))

        threading.Thread(target=listen, daemon=True).start()
        yield f"127.0.0.1:{server.getsockname()[1]}", asked
        # A request that was sent is counted
        time.sleep(0.05)


def texts(address: str) -> dict[str, str]:
    """Return texts that GDAL's drivers follow, by kind."""
    web = f"http://{address}"
    return {
        "vrt": f'<OGRVRTDataSource><OGRVRTLayer name="x"><SrcDataSource>/vsicurl/{web}/a.geojson'
        "</SrcDataSource></OGRVRTLayer></OGRVRTDataSource>",
        "local": '<OGRVRTDataSource><OGRVRTLayer name="secret"><SrcDataSource relativeToVRT="1">'
        "secret.csv</SrcDataSource><GeometryType>wkbPolygon</GeometryType><LayerSRS>EPSG:4326"
        '</LayerSRS><GeometryField encoding="WKT" field="WKT"/></OGRVRTLayer></OGRVRTDataSource>',
        "gdalg": json.dumps(
            {
                "type": "gdal_streamed_alg",
                "command_line": f"gdal vector pipeline ! read /vsicurl/{web}/b.geojson",
            }
        ),
        "wfs": f"<OGRWFSDataSource><URL>{web}/wfs</URL></OGRWFSDataSource>",
        "csw": f"<OGRCSWDataSource><URL>{web}/csw</URL></OGRCSWDataSource>",
        "oapif": f"<OGROAPIFDataSource><URL>{web}/oapif</URL></OGROAPIFDataSource>",
        "wms": f'<GDAL_WMS><Service name="WMS"><ServerUrl>{web}</ServerUrl></Service></GDAL_WMS>',
        "kml": f"<kml><NetworkLink><Link><href>{web}/a.kml</href></Link></NetworkLink></kml>",
        "entity": f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a SYSTEM "{web}/a">]><x>&a;</x>',
        "link": f'{{"type": "Link", "href": "{web}/a.geojson"}}',
        "feature service": json.dumps({"url": f"{web}/FeatureServer/0/query?f=json", "links": []}),
    }


@pytest.mark.parametrize("kind", texts(""))
def test_no_text_leads_elsewhere_whatever_the_suffix(tmp_path, service, kind):
    address, asked = service
    (tmp_path / "secret.csv").write_text(f'id,WKT,height\nTOPSECRET,"{HOUSES[0].wkt}",9\n')
    for suffix in SUFFIXES:
        path = tmp_path / f"town{suffix}"
        path.write_text(texts(address)[kind])
        with pytest.raises(
            CatalogError, match=rf"town\{suffix}: (not |un|no |points|a doc|neither)"
        ):
            read_layer(path)
    assert asked == []


@pytest.fixture
def town(tmp_path):
    def write(name):
        path = tmp_path / name
        shapes = shapely.to_wkb(np.array(HOUSES, dtype=object))
        heights = [np.array([9.0, 6.0, 3.0])]
        pyogrio.raw.write(
            path, shapes, heights, ["height"], geometry_type="Polygon", crs="EPSG:4326"
        )
        return path

    return write


@pytest.mark.parametrize("key", ["crs", "\\u0063rs"])
@pytest.mark.parametrize("place", ["features", "last"])
def test_links_of_geojson_are_not_followed(town, service, key, place):
    # GDAL fetches the system of such a layer
    address, asked = service
    path = town("town.geojson")
    content = json.loads(path.read_text())
    content.pop("crs", None)
    web = f"http://{address}"
    links = {"links": [{"rel": "next", "href": f"{web}/2"}], "$ref": f"{web}/3", "href": web}
    system = {"type": "link", "properties": {"href": f"{web}/a.wkt", "type": "ogcwkt"}}
    text = json.dumps({**content, **links})
    member = f'"{key}": {json.dumps(system)}'
    path.write_text(
        f"{{{member}, {text[1:]}" if place == "features" else f"{text[:-1]}, {member}}}"
    )
    # Without the link, the default of the format holds
    with suppress(CatalogError):
        assert len(read_layer(path).outlines) == 3
    name = {"type": "name", "properties": {"name": f"{web}/b.wkt"}}
    path.write_text(json.dumps({"crs": name, **content}))
    with pytest.raises(CatalogError, match="unknown coordinate reference system"):
        read_layer(path)
    assert asked == []


@pytest.mark.parametrize("form", ["{}/x.gpkg", "/vsicurl/{}/x.gpkg", "/vsizip//vsicurl/{}/x.gpkg"])
def test_an_address_is_no_file_and_is_not_fetched(service, form):
    address, asked = service
    with pytest.raises(CatalogError, match="no such file"):
        read_layer(form.format(f"http://{address}"))
    assert asked == []


def test_parts_of_a_shapefile_are_not_elsewhere(town, tmp_path, service):
    address, asked = service
    path = town("town.shp")
    assert read_layer(path).attributes["height"].tolist() == [9.0, 6.0, 3.0]
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    path.with_suffix(".dbf").rename(elsewhere / "secret.dbf")
    path.with_suffix(".dbf").symlink_to(elsewhere / "secret.dbf")
    with pytest.raises(CatalogError, match=r"its part town\.dbf is a link that leads elsewhere"):
        read_layer(path)
    # A folder in which every part is a link is one place, as workflows stage their inputs
    staged = tmp_path / "staged"
    staged.mkdir()
    path.with_suffix(".dbf").unlink()
    (elsewhere / "secret.dbf").rename(path.with_suffix(".dbf"))
    for part in tmp_path.glob("town.*"):
        (staged / part.name).symlink_to(part)
    assert read_layer(staged / "town.shp").attributes["height"].tolist() == [9.0, 6.0, 3.0]
    # A system of coordinates is text, not an address
    path.with_suffix(".prj").write_text(f"http://{address}/a.prj")
    with pytest.raises(CatalogError, match="reference system"):
        read_layer(path)
    assert asked == []


ENDLESS = (
    "create view a as with recursive n(i) as (select 1 union all select i+1 from n) "
    "select i as fid, (select geom from town limit 1) as geom, 9.0 as height from n"
)


@pytest.fixture
def package(town):
    """GeoPackage with a layer ``town``, after statements of SQL."""

    def changed(*statements):
        path = town("town.gpkg")
        with sqlite3.connect(path) as database:
            triggers = database.execute("select name from sqlite_master where type = 'trigger'")
            for (name,) in triggers.fetchall():
                database.execute(f'drop trigger "{name}"')
            for statement in statements:
                database.execute(statement)
        database.close()
        return path

    return changed


AS_LAYER = (
    "insert into gpkg_contents (table_name, data_type, identifier, srs_id)"
    " values ('a', 'features', 'a', 4326)",
    "insert into gpkg_geometry_columns values ('a', 'geom', 'POLYGON', 4326, 0, 0)",
)


def test_a_view_without_an_end_is_not_read(package):
    # would wait for ever
    path = package(ENDLESS, *AS_LAYER)
    assert read_layer(path).attributes["height"].tolist() == [9.0, 6.0, 3.0]
    assert len(read_layer(path, "town").outlines) == 3
    problem = r"town\.gpkg: layer a is a view, which may have no end: save it as a table"
    with pytest.raises(CatalogError, match=problem):
        read_layer(path, "a")
    # The same without another layer
    with sqlite3.connect(path) as database:
        database.execute("delete from gpkg_geometry_columns where table_name = 'town'")
        database.execute("update gpkg_contents set data_type='attributes' where table_name='town'")
    with pytest.raises(CatalogError, match=problem):
        read_layer(path)


@pytest.mark.parametrize(
    "table", ["gpkg_contents", "gpkg_geometry_columns", "gpkg_spatial_ref_sys", "gpkg_extensions"]
)
def test_tables_of_the_format_are_no_views(package, table):
    endless = (
        f"create view {table} as with recursive n(i) as (select 1 union all select i+1 from n)"
        f" select old.* from old, n"
    )
    path = package("pragma legacy_alter_table = on", f"alter table {table} rename to old", endless)
    # Extensions are not needed
    with suppress(CatalogError):
        assert len(read_layer(path).outlines) == 3


def test_virtual_tables_are_not_opened(package, service):
    address, asked = service
    place = f"/vsicurl/http://{address}/a.gpkg"
    sql = f"CREATE VIRTUAL TABLE a USING VirtualOGR('{place}') -- USING rtree("
    write = (
        "insert into sqlite_master (type, name, tbl_name, rootpage, sql)"
        f" values ('table', 'a', 'a', 0, '{sql.replace(chr(39), chr(39) * 2)}')"
    )
    path = package("pragma writable_schema = on", write, *AS_LAYER)
    assert read_layer(path).attributes["height"].tolist() == [9.0, 6.0, 3.0]
    with pytest.raises(CatalogError, match="layer a is a view"):
        read_layer(path, "a")
    assert asked == []


def test_computed_columns_are_refused(package):
    path = package("alter table town add column x as (hex(height)) virtual")
    with pytest.raises(CatalogError, match="column x of table town is computed"):
        read_layer(path)


def test_triggers_and_views_of_others_do_not_matter(package):
    # would refuse what QGIS and PostGIS users have
    path = package(
        "create trigger t after insert on town begin select 1; end",
        "create view tall as select * from town where height > 5",
        "create table notes (text)",
    )
    assert read_layer(path).attributes["height"].tolist() == [9.0, 6.0, 3.0]


def test_a_folder_with_the_name_of_a_layer(tmp_path):
    for suffix in (".shp", ".parquet", ".gpkg"):
        (tmp_path / f"town{suffix}").mkdir()
        with pytest.raises(CatalogError, match="is no regular file"):
            read_layer(tmp_path / f"town{suffix}")


def test_gdal_has_no_other_drivers_where_layers_are_read():
    # The list of names to leave out may be older than GDAL
    limits = Limits(60.0, 4 << 30)
    code = "__import__('pyogrio').list_drivers()"
    names = read_layer_apart(limits, eval, code)
    assert set(names) <= set(DRIVERS)
    read_layer_apart(limits, require_own_drivers, list(names))


@pytest.mark.parametrize("name", ["town.gpkg", "town.geojson", "town.shp", "town.fgb"])
def test_good_layers_are_the_same_as_in_this_process(town, name):
    # by pyogrio itself
    path = town(name)
    _, _, shapes, fields = pyogrio.raw.read(path)
    raw = read_raw_layer(path, None)
    assert raw.wkb.to_pylist() == list(shapes)
    assert raw.attributes["height"].to_pylist() == fields[0].tolist()
