"""
Cells of tables of pairs and buildings as values: the one way from a text to a number or a word.

A cell may have a unit of its own (``5 cm``), a word of several languages (``bitişik``, ``unknown``,
``Betonarme``), a code of floors (``Z+4``), a placeholder (``-9999``); a gap may also be a range
(``3-5``), an estimate (``~4``) or a limit (``< 2``). What cannot be understood is empty, and its
text goes to the column ``cell_notes``.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from per_obspy.checks import FloatArray
from per_obspy.errors import shortened
from per_obspy.inventory.files.words import (
    Unit,
    named,
    plain_word,
    unit_of,
    unit_of_schema,
    words,
)
from per_obspy.inventory.schema import COLUMNS, EMPTY, ONE_OF, Column

#: Column of the texts that were not understood, or are no exact value.
NOTES = "cell_notes"

#: Longest text that is read as a value, characters.
LONGEST = 40

#: Numbers that programs write where they have none: they mean nothing outside a column's range. A
#: negative gap is an overlap or a mistake, and 0 is a gap.
PLACEHOLDERS = (0.0, -1.0, -9.0, -99.0, -999.0, -9999.0, -99999.0, 999.0, 9999.0, 99999.0)
_OF_GAPS = PLACEHOLDERS[3:]

#: Placeholders that are one within the range of heights too.
_HIGH = (999.0, 9999.0)

#: A number that no column has: fill values of grids are 1e20, 9.97e36, 3.4e38.
_FILL = 1e19

#: A gap that is estimated by eye is between half of it and one and a half (reasoned).
ABOUT = 0.5

#: Where other gaps have a unit, a number without one is in doubt from here on, m (reasoned: gaps
#: in m are hardly wider, and those in cm are hardly a smaller number).
DOUBTFUL = 0.3

#: Standard deviation over width of an even distribution, as gaps in a range have it (reasoned).
EVEN = 1.0 / np.sqrt(12.0)

#: The only column of numbers that may hold truth values: whether pounding was seen.
OBSERVED = "observed"

#: A number with a decimal point or comma.
_DIGITS = r"(?:\d+(?:\.\d*|,\d+)?|[.,]\d+)"
_NUMBER = re.compile(rf"([+-]?{_DIGITS}(?:[eE][+-]?\d+)?)\s*([^\d\s+,.-].*?|)\.?", re.ASCII)
_INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE)
_FEET_AND_INCHES = re.compile(rf"(\d+)\s*(?:ft|['′’])\s*({_DIGITS})\s*(?:in|''|[\"″”])?", re.ASCII)
_STOREYS = re.compile(r"[+-]?\d+(?:\.\d*|,0+|,5)?(?:e[+-]?\d+)?", re.ASCII)
_PLUS_MINUS = re.compile(r"(.*?)\s*(?:±|\+/-|\+-)\s*(.*)")

#: Letters of full width, as Japanese keyboards write them, and a minus of typographers.
_FULL_WIDTH = {code: code - 0xFEE0 for code in range(0xFF01, 0xFF5F)} | {0x3000: 32, 0x2212: 45}


class CellForm(NamedTuple):
    """How the cells of a table are written."""

    #: Column -> unit of its numbers without one, where that is not the schema's.
    units: Mapping[str, Unit] = {}
    #: Column -> its decimal mark, where the column has commas.
    marks: Mapping[str, str] = {}
    #: Of the headings, empty if they are English or of none.
    language: str = ""
    #: A unit other than m that cells of the gaps have, where their heading has none: a number
    #: without a unit is then in doubt.
    gap_unit: str = ""


#: A table whose numbers are in the units of the schema.
PLAIN_CELLS = CellForm()


class Value(NamedTuple):
    """Meaning of one text."""

    #: In the unit of the schema, NaN if it is unknown.
    number: float
    #: Standard deviation of a gap that is no exact one, 0 else.
    deviation: float = 0.0
    #: What is wrong or special about the text, empty if nothing is.
    note: str = ""
    #: Whether it is a number that means nothing.
    is_placeholder: bool = False


class Numbers(NamedTuple):
    """A column of numbers."""

    #: In the unit of the schema; NaN where a cell is empty, unknown or not understood; deviations
    #: are 0 where a value is exact. Shape (n,).
    values: FloatArray
    deviations: FloatArray
    #: Position of a row -> what is wrong or special about its cell.
    notes: dict[int, str]
    #: Position of a row -> number in the unit of the schema that means nothing.
    placeholders: dict[int, float]


def is_number(values: pd.Series) -> bool:
    """Return whether a column's type is that of real numbers: truth values and dates are none."""
    kind = values.dtype
    is_other = pd.api.types.is_bool_dtype(kind) or pd.api.types.is_complex_dtype(kind)
    return pd.api.types.is_numeric_dtype(kind) and not is_other


def plain_numbers(values: pd.Series) -> pd.Series:
    """Return cells as numbers, NaN where they are none; truth values and dates are none."""
    if is_number(values):
        return values
    # As text, as pandas takes dates for nanoseconds and truth values for 0 and 1
    return pd.to_numeric(values.astype(str).mask(values.isna()), errors="coerce")


def bare_name(name: str) -> str:
    """Return a column's name without the number of the building."""
    return re.sub(r"_[12]$", "", name)


def is_unknown(text: str) -> bool:
    """
    Return whether a text is a word for an empty or unknown cell.

    Examples
    --------
    >>> is_unknown("Bilinmiyor"), is_unknown("n/a"), is_unknown("0")
    (True, True, False)
    """
    return text.strip().lower() in EMPTY or plain_word(text) in words("unknown")


def read_numbers(name: str, cells: pd.Series, form: CellForm = PLAIN_CELLS) -> Numbers:
    """
    Return a column as numbers in the unit of the schema.

    Parameters
    ----------
    name : str
        Of the schema, with or without the number of the building.
    cells : Series
        Numbers or text; dates are no numbers, truth values are only in ``observed``.
    form : CellForm, optional
        Of the table.

    Examples
    --------
    >>> read_numbers("height_1", pd.Series(["6 m", "20 ft", "-9999", "?"])).values.round(3)
    array([6.   , 6.096,   nan,   nan])
    """
    if is_number(cells) or (name == OBSERVED and pd.api.types.is_bool_dtype(cells.dtype)):
        raw = cells.to_numpy(dtype=np.float64, na_value=np.nan)
        unit = form.units.get(name)
        numbers = raw if unit is None else raw * unit.numerator / unit.denominator
        deviations, is_none = np.zeros_like(raw), placeholders(name, raw, numbers)
        notes = dict[int, str]()
    else:
        numbers, deviations, is_none, notes = _numbers_of_texts(name, cells, form)
    # Numbers that mean nothing are kept aside, as a message may need them
    lost = {row: float(numbers[row]) for row in np.flatnonzero(is_none).tolist()}
    return Numbers(np.where(is_none, np.nan, numbers), deviations, notes, lost)


def _numbers_of_texts(
    name: str, cells: pd.Series, form: CellForm
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], dict[int, str]]:
    """Return numbers, deviations, which numbers mean nothing, and notes of a column of text."""
    # Each text once: a table has few different ones
    codes, texts = pd.factorize(cells.astype(str).mask(cells.isna(), ""))
    if name == "gap" and not form.gap_unit and name not in form.units:
        form = form._replace(gap_unit=unit_in_cells(texts))
    read = [read_number(name, text, form) for text in texts]
    # Back to the rows
    values = [(value.number, value.deviation, value.is_placeholder) for value in read]
    numbers, deviations, is_none = np.reshape(np.array(values, float), (-1, 3))[codes].T
    return numbers, deviations, is_none > 0.0, _by_row(codes, [value.note for value in read])


def _by_row(codes: NDArray[np.int64], notes: Sequence[str]) -> dict[int, str]:
    """Return the notes by row, from those of the different texts."""
    has_note = np.array([note != "" for note in notes], dtype=bool)
    return {row: notes[codes[row]] for row in np.flatnonzero(has_note[codes]).tolist()}


def placeholders(name: str, raw: FloatArray, values: FloatArray) -> NDArray[np.bool_]:
    """
    Return where numbers mean nothing: placeholders of programs.

    Parameters
    ----------
    name : str
        Column; positions have none, as each row needs them.
    raw, values : (n,) ndarray
        As they are written, and in the unit of the schema.
    """
    # Positions have none, and gaps fewer
    bare = bare_name(name)
    column = COLUMNS.get(name) or COLUMNS.get(f"{name}_1")
    if column is not None and column.required and bare != "gap":
        return np.zeros(raw.shape, dtype=bool)
    low, high = (column.low, column.high) if column else (1e-9, np.inf)
    is_one = np.isin(raw, _OF_GAPS if bare == "gap" else PLACEHOLDERS) | (np.abs(raw) > _FILL)
    is_none = is_one & np.isfinite(raw) & ((values < low) | (values > high))
    if bare in ("height", "storeys", "storey_height"):
        is_none |= np.isin(raw, _HIGH)
    return np.asarray(is_none)


def read_number(name: str, text: str, form: CellForm = PLAIN_CELLS) -> Value:
    """
    Return the meaning of one text in a column of numbers.

    Examples
    --------
    >>> read_number("gap", "5 cm").number, read_number("gap", "bitişik").number
    (0.05, 0.0)
    >>> read_number("storeys_1", "Z+4").number, read_number("damping_1", "5 %").number
    (5.0, 0.05)
    """
    text, plain = text.strip(), text.translate(_FULL_WIDTH).strip()
    if is_unknown(plain):
        return Value(np.nan)
    number = _exact(name, plain, form) if len(plain) <= LONGEST else None
    if number is None:
        wrong = f"{name} = {shortened(text, LONGEST)!r} is not a number"
        return (name == "gap" and _inexact(text, plain, form)) or Value(np.nan, note=wrong)
    # A gap whose unit is in doubt
    if name == "gap" and _lacks_unit(plain, number, form):
        note = f"{name} = {plain!r} has no unit, as other cells have ({form.gap_unit})"
        return Value(np.nan, note=note)
    # As it is written, without its unit
    digits = _NUMBER.fullmatch(plain)
    raw = digits and _decimal(digits[1], form.marks.get(name, ""))
    is_none = placeholders(name, np.array([raw or number]), np.array([number]))
    return Value(number, is_placeholder=bool(is_none[0]))


def _exact(name: str, text: str, form: CellForm) -> float | None:
    """Return the number that a text is in its column, None if it is none."""
    # Storeys may be a code, what was observed an answer
    mark = form.marks.get(name, "")
    if bare_name(name) == "storeys":
        return _storeys(text, form.language, mark)
    answer = plain_word(text)
    if name == OBSERVED and answer in {**words("yes"), **words("no")}:
        return float(answer in words("yes"))
    return float(text) if _INFINITE.fullmatch(text) else _quantity(name, text, mark, form)


def _quantity(name: str, text: str, mark: str, form: CellForm) -> float | None:
    """Return a number with its unit or that of its column, in the unit of the schema."""
    # Feet and inches together
    if unit_of_schema(name) == "m" and (both := _FEET_AND_INCHES.fullmatch(text)):
        inches = _decimal(both[2], mark)
        return None if inches is None else float(both[1]) * 0.3048 + inches * 0.0254
    parts = _NUMBER.fullmatch(text)
    number = _decimal(parts[1], mark) if parts else None
    if parts is None or number is None:
        return None
    unit = unit_of(parts[2], name) if parts[2] else form.units.get(name)
    if unit is None:
        return None if parts[2] else number
    return number * unit.numerator / unit.denominator


def _decimal(text: str, mark: str = "") -> float | None:
    """
    Return a number with a decimal point or comma; None if it may be one with thousands.

    Without a decimal mark of the column, three digits after a comma may be thousands, but after a
    0; in a column of decimal commas those after a point may be.
    """
    sign = {"": ",", ",": r"\."}.get(mark)
    if sign and re.fullmatch(rf"[+-]?(?!0+,)\d+{sign}\d{{3}}(?:[eE].*)?", text, re.ASCII):
        return None
    try:
        return float(text.replace(",", "" if mark == "." else "."))
    except ValueError:
        return None


def _lacks_unit(text: str, number: float, form: CellForm) -> bool:
    """Return whether a gap has no unit where others have one, and its size does not tell it."""
    is_doubtful = bool(form.gap_unit) and number >= DOUBTFUL
    return is_doubtful and not re.search(r"[^\d\s.,eE+-]", text)


def unit_in_cells(texts: Iterable[object]) -> str:
    """Return a unit other than m that texts of gaps have, empty if none has one."""
    plain = (str(text).translate(_FULL_WIDTH)[: LONGEST + 1] for text in texts)
    units = (unit.name for text in plain for unit in _units(text))
    return next((name for name in units if name != "m"), "")


def _units(text: str) -> Iterator[Unit]:
    """Yield the units behind the numbers of a gap."""
    for measure in re.finditer(rf"{_DIGITS}\s*([^\W\d_]+|['′’\"″”]+)", text, re.ASCII):
        if unit := unit_of(measure[1], "gap"):
            yield unit


def _inexact(text: str, plain: str, form: CellForm) -> Value | None:
    """Return a gap that is a word, a range, an estimate or a limit; None if it is none."""
    # Raised digits and fractions are no digits of a number
    is_odd = any(letter.isnumeric() and not letter.isascii() for letter in plain)
    if is_odd or len(plain) > LONGEST:
        return None
    word = plain_word(plain.replace("’", "'").replace("(", " ").replace(")", " "))
    if word in words("touching"):
        return Value(0.0)
    return _estimate(text, word, form) or _range(text, word, form)


def _estimate(text: str, word: str, form: CellForm) -> Value | None:
    """Return a gap that is an estimate or a limit, by the ends of what it may be."""
    for kind, inner in _limits(word):
        number = _bound(inner, form)
        if number is not None and number >= 0.0:
            if kind == "above":
                return _noted(text, number, 0.0, "the least it may be")
            about = (number * (1.0 - ABOUT), number * (1.0 + ABOUT))
            return _even(text, *(about if kind == "about" else (0.0, number)))
    return None


def _range(text: str, word: str, form: CellForm) -> Value | None:
    """Return a gap with a deviation, or one between two, of which the first may lack the unit."""
    for kind, first, second in _splits(word):
        # The unit may be behind both
        unit = next(_units(second), None)
        of_first = form._replace(units={"gap": unit}, gap_unit="") if unit else form
        low, high = _bound(first, of_first), _bound(second, form)
        if low is not None and high is not None:
            if kind == "±":
                return _noted(text, low, high)
            if min(low, high) >= 0.0:
                return _even(text, min(low, high), max(low, high))
    return None


def _splits(word: str) -> Iterator[tuple[str, str, str]]:
    """Yield the parts of a text before and after a sign between two numbers, with the sign."""
    if parts := _PLUS_MINUS.fullmatch(word):
        yield "±", parts[1], parts[2]
        return
    # Words between blanks, signs anywhere
    for separator in words("to"):
        sign = re.escape(separator)
        sign = rf"\s+{sign}\s+" if separator.isalpha() and separator.isascii() else rf"\s*{sign}\s*"
        if parts := re.fullmatch(rf"(.*?\d.*?){sign}(.*\d.*)", word):
            yield separator, parts[1], parts[2]


def _limits(word: str) -> Iterator[tuple[str, str]]:
    """Yield kinds of estimates and limits, with the text without the word at one of its ends."""
    for kind in ("about", "below", "above"):
        for sign in words(kind):
            # No part of a longer word
            is_word = sign[-1].isalpha() and sign.isascii()
            start = rf"{re.escape(sign)}{r'(?![a-z])' if is_word else ''}[\s.]*(.+)"
            before = r"(?<![a-z])" if sign[0].isalpha() and is_word else ""
            for pattern in (start, rf"(.+?){before}\s*{re.escape(sign)}\.?"):
                if parts := re.fullmatch(pattern, word):
                    yield kind, parts[1].strip("() ")


def _bound(text: str, form: CellForm) -> float | None:
    """Return a number of an inexact gap; None where it lacks the unit that other cells have."""
    number = _exact("gap", text, form)
    return None if number is None or _lacks_unit(text, number, form) else number


def _even(text: str, low: float, high: float) -> Value:
    """Return a gap that may as well be anywhere between two."""
    return _noted(text, (low + high) / 2.0, (high - low) * EVEN)


def _noted(text: str, number: float, deviation: float, why: str = "") -> Value:
    """Return an inexact gap with its note; unknown if its deviation is beyond any gap's."""
    quoted = f"gap = {shortened(text, LONGEST)!r}"
    if deviation > COLUMNS["gap_std"].high:
        return Value(np.nan, note=f"{quoted} is too wide a range for a gap in m")
    why = why or f"with a deviation of {deviation:.3g} m"
    return Value(number, deviation, f"{quoted} is read as {number:.3g} m, {why}")


def _storeys(text: str, language: str, mark: str) -> float | None:
    """
    Return a number of storeys above ground; None for lists (``3;4``, ``1,2``) and unusual codes.

    A comma is decimal only before a 0, or before a 5 in a column of decimal commas.
    """
    # Numbers without words for storeys around them
    word, parts = plain_word(text), list[str]()
    for part in word.split("+"):
        bare = part.strip()
        for sign in words("storey"):
            bare = bare.removeprefix(sign).removesuffix(sign).strip()
        parts.append(bare if bare[:1].isdigit() and bare[-1:].isdigit() else part.strip())
    if number := _STOREYS.fullmatch(parts[0] if len(parts) == 1 else word):
        return float(number[0].replace(",", ".")) if mark == "," or ",5" not in word else None
    return _floors(parts, language)


def _floors(parts: Sequence[str], language: str) -> float | None:
    """Return the floors of a code: basements, one ground floor, and those above it."""
    codes = [re.sub(r"^\d+\s*|\s*\d+$", "", part) for part in parts]
    ground = [code for code in codes if code in words("ground")]
    # A code of two kinds needs the language
    sure = [code for code in ground if code not in words("basement")]
    sure = sure or [code for code in ground if language in words("ground")[code]]
    others = {code for code in codes[:-1] if code not in sure}
    if len(sure) != 1 or not others <= set(words("basement")) or sure[0] not in parts:
        return None
    return float(parts[-1]) + 1.0 if re.fullmatch(r"\d{1,3}", parts[-1], re.ASCII) else None


def read_texts(name: str, cells: pd.Series) -> tuple[pd.Series, dict[int, str]]:
    """
    Return stripped text, "" in empty cells, and the notes of those that are none of the choices.

    Parameters
    ----------
    name : str
        Column of text of the schema.
    cells : Series
        Anything; structural systems and answers may be words of several languages.
    """
    # Blanks and words for an empty cell
    column = COLUMNS[name]
    texts = cells.astype(str).str.strip().mask(cells.isna(), "").reset_index(drop=True)
    empty = EMPTY if name in ("pair_id", NOTES) else EMPTY | words("unknown").keys()
    texts = texts.mask(texts.str.lower().isin(empty), "")
    if not column.choices:
        return texts, {}
    # Each text once
    codes, distinct = pd.factorize(texts)
    choices = {text: _choice(column, text) for text in distinct}
    allowed = f"is unknown, expected {', '.join(column.choices)}"
    notes = [
        f"{name} = {shortened(text, LONGEST)!r} {allowed}" if choice is None else ""
        for text, choice in choices.items()
    ]
    values = texts.map({text: choice or "" for text, choice in choices.items()})
    return values, _by_row(codes, notes)


def _choice(column: Column, text: str) -> str | None:
    """Return the choice that a text means, "" if it is unknown, None if it means none of them."""
    word = plain_word(text)
    if not word or word in words("unknown"):
        return ""
    # Answers, and structural systems
    meant = word if word in column.choices else named("system").get(word, "")
    if set(column.choices) == {"yes", "no"}:
        meant = next((answer for answer in column.choices if word in words(answer)), "")
    return meant if meant in column.choices else None


def read_columns(
    columns: Mapping[str, pd.Series], form: CellForm = PLAIN_CELLS
) -> dict[str, pd.Series]:
    """
    Return columns of the schema as values, with the column ``cell_notes`` if there is a note.

    Parameters
    ----------
    columns : mapping of str to Series
        Of one table, by the names of the schema.
    form : CellForm, optional
        Of the table.

    Returns
    -------
    columns : dict
        Numbers as float64, NaN where they are empty or not understood. A gap that is no exact
        value adds its deviation to ``gap_std``. A placeholder is empty if the building has another
        size, and stays what it is otherwise.
    """
    read, notes = dict[str, pd.Series](), list[dict[int, str]]()
    numbers = dict[str, Numbers]()
    # Column by column
    for name, cells in columns.items():
        if COLUMNS[name].dtype == "str":
            read[name], wrong = read_texts(name, cells)
            notes.append(wrong)
        else:
            numbers[name] = column = read_numbers(name, cells, form)
            read[name] = pd.Series(_within_half_turn(name, column.values))
            notes.append(column.notes)
    # Values that rest on several columns
    notes += [_without_size(read, numbers, group) for group in ONE_OF]
    if "gap" in numbers and (deviations := numbers["gap"].deviations).any():
        # Independent errors of a gap in the table and in its cell
        given = read.get("gap_std", pd.Series(deviations * np.nan))
        read["gap_std"] = given.where(deviations == 0.0, np.hypot(given.fillna(0.0), deviations))
    return _with_notes(read, notes) if any(notes) else read


def _within_half_turn(name: str, values: FloatArray) -> FloatArray:
    """Return longitudes of the convention from 0 to 360 degrees as those from -180 to 180."""
    if bare_name(name) != "longitude":
        return values
    return np.where((values > 180.0) & (values <= 360.0), values - 360.0, values)


def _with_notes(
    read: dict[str, pd.Series], notes: Sequence[Mapping[int, str]]
) -> dict[str, pd.Series]:
    """Return columns with the notes of all of them, behind those that the table has already."""
    before = read.get(NOTES, pd.Series("", next(iter(read.values())).index))
    texts = before.astype(object).tolist()
    # Column by column
    for row, note in chain.from_iterable(column.items() for column in notes):
        texts[row] = f"{texts[row]}; {note}" if texts[row] else note
    return read | {NOTES: pd.Series(texts, dtype=object)}


def _without_size(
    read: dict[str, pd.Series], numbers: Mapping[str, Numbers], group: tuple[str, ...]
) -> dict[int, str]:
    """Put back the placeholders of buildings that have no other size; return notes of high ones."""
    sizes = [read[name].isna() for name in group if name in read]
    notes, known = dict[int, str](), [name for name in group if name in numbers]
    for name in known:
        for row, number in numbers[name].placeholders.items():
            if not all(size[row] for size in sizes):
                continue
            # Out of the column's range the number itself is the reason
            if COLUMNS[name].low <= number <= COLUMNS[name].high:
                notes[row] = f"{name} = {number:g} is a placeholder, not a size"
            else:
                read[name][row] = number
    return notes
