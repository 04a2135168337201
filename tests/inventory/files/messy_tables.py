"""Three pairs of buildings as people write them: every kind of messy table, from one plain one."""

import io
import re
import zipfile
from collections.abc import Sequence
from typing import NamedTuple

import openpyxl

#: Headings and rows of the plain table.
NAMES = (
    *("pair_id", "gap", "longitude_1", "latitude_1", "height_1"),
    *("longitude_2", "latitude_2", "height_2", "mass_1", "note"),
)
ROWS = (
    ("a", 0.05, 0.3012, 0.1012, 10.5, 0.3013, 0.1012, 12.25, 1250000.0, "corner"),
    ("b", 0.125, 0.3022, 0.1022, 9.0, 0.3023, 0.1022, 15.5, 980500.0, "old, town"),
    ("c", 0.0, 0.3032, 0.1032, 12.0, 0.3033, 0.1032, 12.0, 2750000.0, ""),
)

SPANISH = (
    *("PAR", "Separación (cm)", "Longitud 1", "Latitud 1", "Altura 1"),
    *("Longitud 2", "Latitud 2", "Altura 2", "Masa 1 (t)", "Notas"),
)
TURKISH = (
    *("Çift No", "Derz Genişliği (cm)", "Boylam 1", "Enlem 1", "Bina 1 Yüksekliği"),
    *("Boylam 2", "Enlem 2", "Bina 2 Yüksekliği", "Kütle 1", "Açıklama"),
)
ITALIAN = (
    *("Coppia", "Giunto [mm]", "Longitudine 1", "Latitudine 1", "Altezza edificio 1"),
    *("Longitudine 2", "Latitudine 2", "Altezza edificio 2", "Massa 1", "Nota"),
)
FRENCH = (
    *("Paire", "Joint parasismique (cm)", "Longitude bât. 1", "Latitude bât. 1", "Hauteur bât. 1"),
    *("Longitude bât. 2", "Latitude bât. 2", "Hauteur bât. 2", "Masse bât. 1", "Remarque"),
)
PORTUGUESE = (
    *("Par", "Junta sísmica (cm)", "Longitude A", "Latitude A", "Altura A"),
    *("Longitude B", "Latitude B", "Altura B", "Massa A", "Nota"),
)
JAPANESE = (
    *("組番号", "隙間(cm)", "経度1", "緯度1", "高さ1(m)"),
    *("経度2", "緯度2", "高さ2(m)", "質量1", "備考"),
)
AMERICAN = (
    *("Pair ID", "gap_in", "lon1", "lat1", "height_1_ft"),
    *("lon2", "lat2", "height_2_ft", "MASS_1", "note"),
)


class Messy(NamedTuple):
    """
    A messy table.

    Attributes
    ----------
    file : str
        Its name.
    content : bytes
        Bytes of the file.
    """

    file: str
    content: bytes


def rows_of(factors: dict[int, float] | None = None) -> list[list[object]]:
    """Return the rows with some columns in other units: place -> factor."""
    rows = [list(row) for row in ROWS]
    for place, factor in (factors or {}).items():
        for row in rows:
            row[place] = round(row[place] * factor, 9)
    return rows


def text_of(
    names: Sequence[str],
    rows: Sequence[Sequence[object]],
    separator: str = ",",
    decimal: str = ".",
    ending: str = "\n",
) -> str:
    """Return a table as text."""
    lines = [separator.join(names)]
    for row in rows:
        cells = [
            f"{cell:.12g}".replace(".", decimal) if isinstance(cell, float) else str(cell)
            for cell in row
        ]
        quoted = [f'"{cell}"' if separator in cell else cell for cell in cells]
        lines.append(separator.join(quoted))
    return ending.join([*lines, ""])


def workbook_of(sheets: dict[str, Sequence[Sequence[object]]]) -> bytes:
    """Return a workbook; a text ``=FORMULA|VALUE`` is a formula with its stored value."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for number, row in enumerate(rows, 1):
            for place, value in enumerate(row, 1):
                sheet.cell(number, place).value = value
    content = io.BytesIO()
    book.save(content)
    return with_values(content.getvalue())


def changed_parts(book: bytes, change) -> bytes:
    """Return a workbook whose parts are changed: ``change(name, content) -> content``."""
    target = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(book)) as source,
        zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as changed,
    ):
        for name in source.namelist():
            changed.writestr(name, change(name, source.read(name)))
    return target.getvalue()


def with_values(book: bytes) -> bytes:
    """Return a workbook whose formulas ``=X|VALUE`` have their values, as programs store them."""

    def change(_: str, content: bytes) -> bytes:
        pattern = rb"<f>([^<|]*)\|([^<]*)</f><v\s*/?>(?:</v>)?"
        return re.sub(pattern, rb"<f>\1</f><v>\2</v>", content)

    return changed_parts(book, change)


def plain() -> Messy:
    """Return the plain table."""
    return Messy("pairs.csv", text_of(NAMES, ROWS).encode())


def readable() -> dict[str, Messy]:
    """Return every readable kind of messy table, by its defect."""
    cm, mm, t = {1: 100.0}, {1: 1000.0}, {8: 0.001}
    upper = [name.upper() for name in NAMES]
    grouped = text_of(NAMES, ROWS, ";").replace("1250000", "1,250,000").replace("980500", "980,500")
    feet = rows_of({1: 1 / 0.0254, 4: 1 / 0.3048, 7: 1 / 0.3048})
    formulas = [list(row) for row in rows_of(cm | t)]
    formulas[0][1] = "=2+3|5"
    spanish = [["Levantamiento 2026"], [], SPANISH, *formulas]
    return {
        "semicolons and decimal commas": Messy(
            "pairs.csv", text_of(NAMES, ROWS, ";", ",", "\r\n").encode()
        ),
        'tabulators in UTF-16 ("Unicode text")': Messy(
            "pairs.txt", text_of(NAMES, ROWS, "\t", ",", "\r\n").encode("utf-16")
        ),
        "a byte order mark and headings in capitals": Messy(
            "pairs.csv", text_of(upper, ROWS).encode("utf-8-sig")
        ),
        "Spanish, cp1252, gap in cm, mass in t": Messy(
            "pares.csv", text_of(SPANISH, rows_of(cm | t), ";", ",").encode("cp1252")
        ),
        "Turkish, cp1254, gap in cm": Messy(
            "ciftler.csv",
            text_of(TURKISH, rows_of(cm), ";", ",").encode("cp1254"),
        ),
        "Italian, gap in mm": Messy(
            "coppie.csv", text_of(ITALIAN, rows_of(mm), ";", ",").encode("cp1252")
        ),
        "French, cp1252": Messy(
            "paires.csv", text_of(FRENCH, rows_of(cm), ";", ",").encode("cp1252")
        ),
        "Portuguese, buildings A and B": Messy(
            "pares.csv", text_of(PORTUGUESE, rows_of(cm), ";", ",").encode()
        ),
        "Japanese, cp932": Messy("pairs.csv", text_of(JAPANESE, rows_of(cm)).encode("cp932")),
        "feet and inches": Messy("pairs.csv", text_of(AMERICAN, feet).encode()),
        "commas between thousands": Messy("pairs.csv", grouped.encode()),
        "a title above the header": Messy(
            "pairs.csv", ("Old town;;;\n\n" + text_of(NAMES, ROWS, ";", ",")).encode()
        ),
        "a workbook with a title, formulas and a second sheet": Messy(
            "pares.xlsx", workbook_of({"Notas": [["de la encuesta"]], "Pares": spanish})
        ),
    }


def refused() -> dict[str, Messy]:
    """Return every refused kind of messy table, by its ambiguity."""
    whole = [[row[0], 2.345, *row[2:4], 10.125, *row[5:7], 12.25, *row[8:]] for row in ROWS]
    doubtful = [[*row[:7], 12.125, 2500.0, row[9]] for row in whole]
    points = text_of(NAMES, doubtful, ";")
    for number in ("2.345", "10.125", "12.125"):
        points = points.replace(number, number.replace(".", ","))
    named = [["Şişli-1", *ROWS[0][1:]], ["Şişli-2", *ROWS[1][1:]]]
    distance = ["distance" if name == "gap" else name for name in NAMES]
    table = [NAMES, *ROWS]
    cut = text_of(NAMES, [[*row[:9], "café"] for row in ROWS]).encode() + b"\xe9\n"
    buildings = "id,Longitude,Latitude,NumberOfStories\n1,0.3,0.1,2\n2,0.3001,0.1,3\n"
    commas = text_of(NAMES, ROWS, ",", ",").replace('"', "")
    return {
        "`2,345` and no number that decides": Messy("pairs.csv", points.encode()),
        "decimal commas between commas": Messy("pairs.csv", commas.encode()),
        "names in cp1252 or cp1254, English headings": Messy(
            "pairs.csv", text_of(NAMES, named).encode("cp1254")
        ),
        "an ambiguous heading": Messy("pairs.csv", text_of(distance, ROWS).encode()),
        "a workbook with two pair tables": Messy(
            "pairs.xlsx", workbook_of({"2025": table, "2026": table})
        ),
        "a formula that was never computed": Messy(
            "pairs.xlsx", workbook_of({"Pairs": [NAMES, ["a", "=2+3", *ROWS[0][2:]]]})
        ),
        "UTF-8 with a damaged letter": Messy("pairs.csv", cut),
        "a list of buildings": Messy("buildings.csv", buildings.encode()),
        "a damaged old workbook": Messy("pairs.xls", b"\xd0\xcf\x11\xe0" + bytes(500)),
    }


def suspected() -> Messy:
    """Return a table whose gaps are in centimetres, under a heading without a unit."""
    rows = [[*row] for row in rows_of({1: 100.0})]
    return Messy("pairs.csv", text_of(NAMES, rows[:1]).encode())


def with_shared_texts(book: bytes) -> bytes:
    """Return a workbook whose texts are in a part of their own, as most programs store them."""
    texts: list[bytes] = []

    def shared(cell: re.Match[bytes]) -> bytes:
        texts.append(cell[2])
        return b'<c r="%b" t="s"><v>%d</v></c>' % (cell[1], len(texts) - 1)

    def change(name: str, content: bytes) -> bytes:
        if name == "[Content_Types].xml":
            kind = b"application/vnd.openxmlformats-officedocument.spreadsheetml.sharedStrings+xml"
            part = b'<Override PartName="/xl/sharedStrings.xml" ContentType="%b"/></Types>' % kind
            return content.replace(b"</Types>", part)
        cell = rb'<c r="(\w+)" t="inlineStr"><is><t[^>]*>([^<]*)</t></is></c>'
        return re.sub(cell, shared, content) if "worksheets" in name else content

    changed = io.BytesIO(changed_parts(book, change))
    with zipfile.ZipFile(changed, "a", zipfile.ZIP_DEFLATED) as archive:
        items = b"".join(b"<si><t>%b</t></si>" % text for text in texts)
        main = b"http://schemas.openxmlformats.org/spreadsheetml/2006/main"
        archive.writestr("xl/sharedStrings.xml", b'<sst xmlns="%b">%b</sst>' % (main, items))
    return changed.getvalue()
