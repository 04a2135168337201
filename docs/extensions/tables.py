"""Tables of generated pages, as Markdown."""

from collections.abc import Iterable, Sequence
from pathlib import Path


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; bars inside cells are escaped."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(map(_cell, line))} |" for line in lines) + "\n"


def _cell(text: str) -> str:
    """Return the text of a cell without bars, asterisks and line breaks that end it."""
    return " ".join(text.split()).replace("|", r"\|").replace("*", r"\*")


def code(text: str) -> str:
    """Return text as code inside a table, empty if there is none."""
    return f"`{text}`" if text else ""


def write_page(path: Path, *parts: str) -> None:
    """Write a page, unless it already has this content: Sphinx reads changed pages only."""
    content = "\n\n".join(part.strip() for part in parts) + "\n"
    if not path.exists() or path.read_text(encoding="utf-8") != content:
        path.write_text(content, encoding="utf-8")
