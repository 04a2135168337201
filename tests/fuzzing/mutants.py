"""Damaged copies of a file: cuts, noise, repetitions, hostile words, long words."""

import random

#: Lengths of the words that are put into a file, characters; 1 000 000 once asked for 80 GiB.
LENGTHS = (45, 400, 3000, 40_000, 1_000_000)

#: Letters of which long words are made.
LETTERS = (
    b"1",
    b"0",
    b".",
    b"-",
    b" ",
    b"A",
    b"e",
    b"1 ",
    b"\n",
    b"1\n",
    b":",
    b"/",
    b'"',
    b",",
    b"[",
    b"<a>",
    b"\x00",
    b"\xff",
)

#: Words with a meaning of their own somewhere: to a parser, a shell, a spreadsheet or a path.
WORDS = (
    b"-999",
    b"999999999999",
    b"1E300",
    b"nan",
    b"",
    b"\n",
    b"*****",
    b"-",
    b"0",
    b"1e-300",
    b"true",
    b"../../../victim",
    b"/etc/passwd",
    b"http://localhost:9/x",
    b"=1+1",
    b'"',
    b"'",
    b"$x_$",
    b"[/red]",
    b"<!DOCTYPE x [<!ENTITY a 'b'>]>",
    b"\xe2\x80\xae",
    b"obspy.core.stream",
    b"/vsicurl/http://127.0.0.1:9/x",
    b"<OGRVRTDataSource>",
)

#: Sizes of the pieces that are replaced, bytes.
SIZES = (0, 1, 5, 12, 80, 400)


def damaged(content: bytes, chance: random.Random) -> bytes:
    """Return a copy with one to three damages."""
    for _ in range(chance.randint(1, 3)):
        content = _damaged_once(content, chance)
    return content


def _damaged_once(content: bytes, chance: random.Random) -> bytes:
    """Return a copy that is cut, or of which a piece is replaced."""
    place = chance.randrange(len(content) + 1)
    kind = chance.randrange(8)
    if kind == 0:
        # A cut, which some systems end with a line or fill with zeros
        return content[:place] + chance.choice((b"", b"\n", b"\r\n", bytes(9)))
    size = chance.choice(SIZES)
    old = content[place : place + size]
    return content[:place] + _piece(kind, old, chance) + content[place + size :]


def _piece(kind: int, old: bytes, chance: random.Random) -> bytes:
    """Return the replacement of a piece: a word, noise, flipped bits, a double, or a long word."""
    if kind == 1:
        return chance.choice(WORDS)
    if kind == 2:
        return chance.randbytes(len(old))
    if kind == 3:
        return bytes(byte ^ (1 << chance.randrange(8)) for byte in old)
    if kind == 4:
        return old * 2
    letters = chance.choice(LETTERS)
    return letters * (chance.choice(LENGTHS) // len(letters))
