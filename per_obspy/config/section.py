"""Base of all settings: frozen sections, relative paths, TOML reading and error messages."""

import os
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    SerializationInfo,
    ValidationError,
    ValidationInfo,
)
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from per_obspy.constants import LANGUAGES
from per_obspy.errors import CatalogError, did_you_mean
from per_obspy.files import looks_like


def _named(path: object) -> object:
    """Return a path that has a name: an empty one would be the folder of the configuration."""
    if isinstance(path, str) and not path.strip():
        raise ValueError("the path is empty: name a file or folder, '.' for this one")
    return path


def _from_folder(path: Path, info: ValidationInfo) -> Path:
    """Return a path of a configuration seen from the folder of its file."""
    return Path(os.path.normpath(info.context["folder"] / path)) if info.context else path


def _to_folder(path: Path, info: SerializationInfo) -> str:
    """Return the path as a configuration in that folder would write it."""
    return os.path.relpath(path, info.context["folder"]) if info.context else str(path)


def _moment(text: str) -> str:
    """Return a time as it was given, if it is one."""
    datetime.fromisoformat(text)
    return text


def _language(name: str) -> str:
    """Return a language that has a catalogue of texts."""
    if name not in LANGUAGES:
        raise ValueError(f"{name!r} is no language of the page: {', '.join(LANGUAGES)}")
    return name


Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
Language = Annotated[str, AfterValidator(_language)]
Moment = Annotated[str, AfterValidator(_moment)]
RelativePath = Annotated[
    Path, BeforeValidator(_named), AfterValidator(_from_folder), PlainSerializer(_to_folder)
]


class Section(BaseModel):
    """A frozen group of settings; unknown keys and numbers that are not finite are errors."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, ser_json_inf_nan="strings"
    )


SectionType = TypeVar("SectionType", bound=Section)


def load(path: Path, section: type[SectionType]) -> SectionType:
    """
    Read a configuration.

    Parameters
    ----------
    path : Path
        TOML file; paths in it are relative to its folder.
    section : type of Section
        Section of the whole file: :class:`Run` or :class:`Simulation`.

    Raises
    ------
    CatalogError
        If the file cannot be read, or naming every key that is unknown, missing or has a wrong
        value.
    """
    return checked(section, read_toml(path), str(path), path.resolve().parent)


def read_toml(path: Path) -> dict[str, object]:
    """
    Return the content of a TOML file.

    Raises
    ------
    CatalogError
        If the file cannot be read.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CatalogError(str(path), f"cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # also too many digits, or lists in lists
        kind = looks_like(path)
        raise CatalogError(
            str(path), f"cannot be read as TOML: {f'is {kind}' if kind else error}"
        ) from error


def checked(
    section: type[SectionType],
    content: dict[str, object],
    source: str = "command line",
    folder: Path | None = None,
) -> SectionType:
    """
    Return the settings of a section.

    Parameters
    ----------
    section : type of Section
        Section of the content.
    content : dict
        Key to value, as TOML gives it.
    source : str
        Where the content comes from, for the error.
    folder : Path, optional
        Folder to which paths are relative.

    Raises
    ------
    CatalogError
        Naming every key that is unknown, missing or has a wrong value.
    """
    try:
        return section.model_validate(content, context=folder and {"folder": folder})
    except ValidationError as error:
        faults = [fault for fault in error.errors() if not _follows(fault, error.errors())]
        raise CatalogError(source, "; ".join(_fault(fault, section) for fault in faults)) from error


def _follows(fault: ErrorDetails, faults: Sequence[ErrorDetails]) -> bool:
    """Return whether a list is too short only because its elements are wrong."""
    depth = len(fault["loc"])
    inside = [
        other
        for other in faults
        if len(other["loc"]) > depth and other["loc"][:depth] == fault["loc"]
    ]
    return fault["type"] == "too_short" and bool(inside)


def _fault(fault: ErrorDetails, section: type[Section]) -> str:
    """Return one fault of a configuration as text: key, fault, value and expected value."""
    # The key, and the value unless it is missing or already in the message
    key = ".".join(map(str, fault["loc"]))
    prefix = f"{key}: " if key else ""
    given = "" if fault["type"] in {"missing", "value_error"} else f" (got {fault['input']!r:.60})"
    fields, name = _fields_at(section, fault["loc"])
    if fault["type"] == "extra_forbidden":
        return f"{prefix}unknown key{given}{_place_of(name, fields) or did_you_mean(name, fields)}"
    meaning = fields[name].description if name in fields else None
    expected = f", expected: {meaning}" if meaning and given else ""
    return f"{prefix}{fault['msg'].removeprefix('Value error, ')}{given}{expected}"


def _place_of(key: str, fields: dict[str, FieldInfo]) -> str:
    """Return the neighbouring section to which a key belongs, empty if there is none."""
    inside = (
        name
        for name, field in fields.items()
        for inner in sections_of(field.annotation)
        if key in inner.model_fields
    )
    return next((f", it belongs to [{name}]" for name in inside), "")


def _fields_at(
    section: type[Section], keys: Sequence[str | int]
) -> tuple[dict[str, FieldInfo], str]:
    """Return the last key that is neither a list index nor a table, and the fields next to it."""
    name = ""
    for key in keys:
        if isinstance(key, int):
            continue
        inner = next(sections_of(section.model_fields[name].annotation), None) if name else section
        if inner is None:  # a table whose keys are free
            break
        section, name = inner, key
    return section.model_fields, name


def sections_of(annotation: Any) -> Iterator[type[Section]]:
    """Yield the sections named in the type of a field, whether single, optional or repeated."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for inner in get_args(annotation):
        yield from sections_of(inner)


def with_paths(
    content: Mapping[str, Any], section: type[Section], change: Callable[[str], str]
) -> dict[str, Any]:
    """
    Return the content of a configuration with every path changed.

    Parameters
    ----------
    content : mapping
        Key to value, as TOML gives it; values of a wrong type stay as they are.
    section : type of Section
        Model of the content.
    change : callable
        Path to path, as text.
    """
    result = dict(content)
    for name in content.keys() & section.model_fields.keys():
        value, annotation = content[name], section.model_fields[name].annotation
        model = next(sections_of(annotation), None)
        # A table, several tables, or a path
        if model is not None and isinstance(value, Mapping):
            result[name] = with_paths(value, model, change)
        elif model is not None and isinstance(value, list):
            is_table = [isinstance(one, Mapping) for one in value]
            if all(is_table):
                result[name] = [with_paths(one, model, change) for one in value]
        elif _is_path(annotation) and isinstance(value, str) and value.strip():
            result[name] = change(value)
    return result


def _is_path(annotation: Any) -> bool:
    """Return whether a key holds a path."""
    return annotation is Path or any(map(_is_path, get_args(annotation)[:1]))
