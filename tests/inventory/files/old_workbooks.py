"""Workbooks of the kinds that openpyxl does not write (.ods, .xlsb, .xls), as small as can be."""

import io
import struct
import zipfile
from collections.abc import Sequence
from xml.sax.saxutils import escape

Rows = Sequence[Sequence[object]]

_ODS = "urn:oasis:names:tc:opendocument:xmlns:"
_RELATIONS = "http://schemas.openxmlformats.org/package/2006/relationships"


def workbook_of_kind(suffix: str, name: str, rows: Rows) -> bytes:
    """Return a workbook of one sheet; the text ``#REF!`` is an error."""
    return {".ods": _ods, ".xlsb": _xlsb, ".xls": _xls}[suffix](name, rows)


def _zip(parts: dict[str, str | bytes]) -> bytes:
    """Return a packed workbook."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for part, text in parts.items():
            archive.writestr(part, text)
    return content.getvalue()


def _ods(name: str, rows: Rows) -> bytes:
    """Return an OpenDocument workbook."""
    lines = []
    for row in rows:
        cells = [
            f'<table:table-cell office:value-type="float" office:value="{cell!r}"/>'
            if isinstance(cell, float)
            else '<table:table-cell office:value-type="string">'
            f"<text:p>{escape(str(cell))}</text:p></table:table-cell>"
            for cell in row
        ]
        lines.append(f"<table:table-row>{''.join(cells)}</table:table-row>")
    spaces = " ".join(f'xmlns:{key}="{_ODS}{key}:1.0"' for key in ("office", "table", "text"))
    body = f'<table:table table:name="{name}">{"".join(lines)}</table:table>'
    return _zip(
        {
            "mimetype": "application/vnd.oasis.opendocument.spreadsheet",
            "META-INF/manifest.xml": f'<m:manifest xmlns:m="{_ODS}manifest:1.0"/>',
            "content.xml": f"<office:document-content {spaces}><office:body><office:spreadsheet>"
            f"{body}</office:spreadsheet></office:body></office:document-content>",
        }
    )


def _xlsb(name: str, rows: Rows) -> bytes:
    """Return a binary workbook, [MS-XLSB] 2.1.4."""

    def record(kind: int, data: bytes = b"") -> bytes:
        head = bytes([kind]) if kind < 128 else bytes([kind & 0x7F | 0x80, kind >> 7])
        size = len(data)
        return head + bytes([size & 0x7F | 0x80, size >> 7]) + data

    def text(value: str) -> bytes:
        return struct.pack("<I", len(value)) + value.encode("utf-16-le")

    sheet = [record(129), record(148, struct.pack("<4I", 0, len(rows) - 1, 0, len(rows[0]) - 1))]
    sheet.append(record(145))
    for number, row in enumerate(rows):
        sheet.append(record(0, struct.pack("<IIHBBBI", number, 0, 300, 0, 0, 0, 0)))
        for place, cell in enumerate(row):
            head = struct.pack("<II", place, 0)
            if cell == "#REF!":
                sheet.append(record(3, head + b"\x17"))
            elif isinstance(cell, float):
                sheet.append(record(5, head + struct.pack("<d", cell)))
            else:
                sheet.append(record(6, head + text(str(cell))))
    bundle = record(156, struct.pack("<II", 0, 1) + text("rId1") + text(name))
    kind = "http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet"
    relation = f'<Relationship Id="rId1" Type="{kind}" Target="worksheets/sheet1.bin"/>'
    return _zip(
        {
            "xl/workbook.bin": record(131) + record(143) + bundle + record(144) + record(132),
            "xl/_rels/workbook.bin.rels": f'<Relationships xmlns="{_RELATIONS}">{relation}'
            "</Relationships>",
            "xl/worksheets/sheet1.bin": b"".join([*sheet, record(146), record(130)]),
        }
    )


def _xls(name: str, rows: Rows) -> bytes:
    """Return an old workbook: BIFF8, [MS-XLS] 2.1, in a compound file, [MS-CFB] 2."""

    def record(kind: int, data: bytes = b"") -> bytes:
        return struct.pack("<HH", kind, len(data)) + data

    def text(value: str) -> bytes:
        return b"\x01" + value.encode("utf-16-le")

    sheet = [record(0x809, struct.pack("<HHHHII", 0x600, 0x10, 0, 0, 0, 0))]
    for number, row in enumerate(rows):
        for place, cell in enumerate(row):
            head = struct.pack("<HHH", number, place, 0)
            if cell == "#REF!":
                sheet.append(record(0x205, head + b"\x17\x01"))
            elif isinstance(cell, float):
                sheet.append(record(0x203, head + struct.pack("<d", cell)))
            else:
                label = struct.pack("<H", len(str(cell))) + text(str(cell))
                sheet.append(record(0x204, head + label))
    globals_ = [record(0x809, struct.pack("<HHHHII", 0x600, 5, 0, 0, 0, 0))]
    bound = bytes([0, 0, len(name)]) + text(name)
    start = len(globals_[0]) + 4 + 4 + len(bound) + 4
    globals_ += [record(0x85, struct.pack("<I", start) + bound), record(0x0A)]
    return _compound(b"".join([*globals_, *sheet, record(0x0A)]))


def _compound(stream: bytes) -> bytes:
    """Return a compound file with one stream, ``Workbook``: sector 0 is its table, 1 its folder."""
    sectors = max(len(stream), 4096) // 512 + 1
    table = [0xFFFFFFFD, 0xFFFFFFFE, *range(3, sectors + 2), 0xFFFFFFFE]
    assert len(table) <= 128
    table += [0xFFFFFFFF] * (128 - len(table))

    def entry(name: str, kind: int, child: int, first: int, size: int) -> bytes:
        encoded = name.encode("utf-16-le")
        head = encoded.ljust(64, b"\0") + struct.pack("<HBB", len(encoded) + 2, kind, 1)
        links = struct.pack("<III", 0xFFFFFFFF, 0xFFFFFFFF, child)
        return head + links + bytes(36) + struct.pack("<IQ", first, size)

    size = sectors * 512
    folder = entry("Root Entry", 5, 1, 0xFFFFFFFE, 0) + entry("Workbook", 2, 0xFFFFFFFF, 2, size)
    header = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16)
    header += struct.pack("<HHHHH6xIIIIIIIII", 0x3E, 3, 0xFFFE, 9, 6, 0, 1, 1, 0, 4096,
                          0xFFFFFFFE, 0, 0xFFFFFFFE, 0)  # fmt: skip
    header += struct.pack("<109I", 0, *[0xFFFFFFFF] * 108)
    return (
        header + struct.pack("<128I", *table) + folder.ljust(512, b"\0") + stream.ljust(size, b"\0")
    )
