"""
Code blocks of README and docs, with the comment in front of each.

A comment ``<!-- ... -->`` on the line before a block is one of

* ``file: NAME``: the block is the content of this file;
* ``with: WORD=VALUE ...``: the block runs with these words replaced;
* ``not run: REASON``: the block cannot run here; ``no block is run: REASON``: none of the page.

Any other block of a shell or of Python runs as it is. The blocks of a page run one after another.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]

#: Languages of blocks that run.
SHELLS, PYTHON = ("console", "bash", "sh"), "python"

_BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>[^\n]*?) -->\n)?^```(?P<language>\w*)[^\n]*\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
_WHOLE_PAGE = re.compile(r"^<!-- no block is run: (.*?) -->$", re.MULTILINE)


class Block(NamedTuple):
    """
    One fenced block.

    Attributes
    ----------
    page : str
        Path of the page from the root of the repository.
    language : str
        Word behind the fence, empty if none.
    text : str
        Content, with words replaced.
    kind : str
        ``file``, ``run`` or ``not run``.
    note : str
        Name of the file, or the reason.
    """

    page: str
    language: str
    text: str
    kind: str
    note: str


def pages() -> list[Path]:
    """Return README and all pages of docs, without generated ones."""
    docs = ROOT / "docs"
    found = (page for page in sorted(docs.rglob("*.md")) if "generated" not in page.parts)
    return [ROOT / "README.md", *found]


def blocks(page: Path) -> Iterator[Block]:
    """Yield the blocks of a page."""
    text, name = page.read_text(encoding="utf-8"), page.relative_to(ROOT).as_posix()
    whole = _WHOLE_PAGE.search(text)
    for found in _BLOCK.finditer(text):
        language, content = found["language"], found["text"]
        word, _, note = (found["mark"] or "").partition(": ")
        if word in ("file", "not run"):
            yield Block(name, language, content, word, note)
        elif whole:
            yield Block(name, language, content, "not run", whole[1])
        else:
            words = dict(pair.split("=") for pair in note.split()) if word == "with" else {}
            for placeholder, value in words.items():
                assert placeholder in content, f"{name}: no {placeholder} in the block"
                content = content.replace(placeholder, value)
            yield Block(name, language, content, "run", "")


def commands(block: Block) -> list[str]:
    """Return the commands of a shell block: lines after ``$``, or all lines if none has it."""
    lines = block.text.splitlines()
    prompted = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
    return prompted or [line for line in lines if line.strip()]
