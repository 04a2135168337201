"""The reference of the configuration, from the pydantic models that read it."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import tomlkit
from pydantic.fields import FieldInfo
from tables import code, table, write_page

from per_obspy.config.pairs import Simulation
from per_obspy.config.run import Design, Ensemble, Run
from per_obspy.config.section import Section, sections_of

#: Models of whole files: title and first lines of their part of the page.
FILES: dict[str, tuple[type[Section], str]] = {
    "A run": (Run, "Read by `per-obspy run FILE.toml`; `per-obspy init` writes one with all keys."),
    "A screening by a design spectrum": (Design, "Read by `per-obspy screen FILE.toml`."),
    "An ensemble of scenarios": (Ensemble, "Read by `per-obspy screen FILE.toml`."),
    "A simulated earthquake": (Simulation, "Named by the key `simulation` of a run."),
}

#: Units that a description may contain, longest first.
_UNIT = re.compile(
    r"(?<![\w/])(kg/m2|kg/m3|m/s2|m/s|m2|1/year|Hz|degrees|bytes|fractions? of critical|"
    r"log-standard deviation|km|m|s|g)(?![\w/'-])"
)

INTRODUCTION = """
# Configuration

Every key of every configuration file, made from the models that read the files. A key that is
missing has its default; an unknown key or a value out of range is refused with one line that names
the file, the key and the value. Paths are relative to the folder of the file. Each key of a run is
also an option of the command line: `--set screening.exact=false`. Tables (`[screening.states]`)
follow their keys; a table marked with `[[...]]` may occur several times. The unit is that which the
help names; a key without unit is a number without dimension, a text, or a path.
"""


def write(folder: Path) -> None:
    """Write ``configuration.md`` to the folder."""
    parts, seen = [INTRODUCTION], set[type[Section]]()
    for title, (model, first) in FILES.items():
        parts += [f"## {title}", first]
        for path, section, repeated in _tables(model, ""):
            if path:
                parts.append(f"### `{f'[[{path}]]' if repeated else f'[{path}]'}`")
                parts.append(f"{(section.__doc__ or '').strip().partition(chr(10))[0]}")
            if section in seen:
                parts.append("The keys are those of the table of this name above.")
            else:
                parts.append(table(("key", "default", "unit", "range", "help"), _rows(section)))
            seen.add(section)
    write_page(folder / "configuration.md", *parts)


def fields() -> Iterator[tuple[type[Section], str, FieldInfo]]:
    """Yield every key of every model once: model, name, field."""
    seen = set()
    for model, _ in FILES.values():
        for _, section, _ in _tables(model, ""):
            if section not in seen:
                seen.add(section)
                for name, field in section.model_fields.items():
                    yield section, name, field


def _tables(model: type[Section], path: str) -> Iterator[tuple[str, type[Section], bool]]:
    """Yield a table and all tables inside it: path, model, whether it may be repeated."""
    yield path, model, False
    for name, field in model.model_fields.items():
        inner_path = f"{path}.{name}" if path else name
        for inner in dict.fromkeys(sections_of(field.annotation)):
            repeated = Ellipsis in get_args(field.annotation)
            tables = list(_tables(inner, inner_path))
            if model.__name__ == "Checks":  # one table that all checks share
                tables = []
            yield from [(tables[0][0], inner, repeated), *tables[1:]] if tables else []


def _rows(section: type[Section]) -> Iterator[tuple[str, str, str, str, str]]:
    """Yield one line per key: name, default, unit, range, help."""
    for name, field in section.model_fields.items():
        if list(sections_of(field.annotation)) and section.__name__ != "Checks":
            continue
        description = field.description or ""
        unit = _UNIT.search(description) if _is_number(field.annotation) else None
        yield (
            code(name),
            _default(field),
            unit.group(1) if unit else "",
            _range(field),
            description,
        )


def _is_number(annotation: Any) -> bool:
    """Return whether a key holds a number, several of them, or a check with a threshold."""
    is_check = isinstance(annotation, type) and issubclass(annotation, Section)
    return annotation in (float, int) or is_check or any(map(_is_number, get_args(annotation)))


def _default(field: FieldInfo) -> str:
    """Return the default of a key as in TOML; empty where there is none."""
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None:
        return ""
    if isinstance(value, Section):
        pairs = (f"{key} = {_toml(one)}" for key, one in value.model_dump(mode="json").items())
        return code(f"{{ {', '.join(pairs)} }}")
    return code(_toml(value))


def _toml(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, dict):
        pairs = (f"{tomlkit.key(str(key)).as_string()} = {one}" for key, one in value.items())
        return f"{{ {', '.join(pairs)} }}"
    return str(tomlkit.item(list(value) if isinstance(value, tuple) else value).as_string())


def _range(field: FieldInfo) -> str:
    """Return the limits of a number and the texts that are allowed."""
    signs = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    limits = [
        f"{sign} {getattr(limit, name):g}"
        for limit in field.metadata
        for name, sign in signs.items()
        if isinstance(getattr(limit, name, None), int | float)
    ]
    patterns = [getattr(limit, "pattern", None) for limit in field.metadata]
    words = [", ".join(pattern.strip("^()$").split("|")) for pattern in patterns if pattern]
    literals = [str(one) for one in _literals(field.annotation)]
    return ", ".join([*limits, *words, *literals])


def _literals(annotation: Any) -> Iterator[object]:
    """Yield the values of a type that names them."""
    for one in get_args(annotation):
        if isinstance(one, str | int):
            yield one
        else:
            yield from _literals(one)
