"""What all settings share: frozen groups, paths seen from the file, reading, and the wording of every fault."""

import os
import tomllib
from datetime import datetime
from pathlib import Path
from typing import Annotated, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    PlainSerializer,
    SerializationInfo,
    ValidationError,
    ValidationInfo,
)
from pydantic_core import ErrorDetails

from per_obspy.errors import CatalogError


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


Moment = Annotated[str, AfterValidator(_moment)]
RelativePath = Annotated[Path, AfterValidator(_from_folder), PlainSerializer(_to_folder)]


class Section(BaseModel):
    """A frozen group of settings; an unknown key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="strings")


SectionType = TypeVar("SectionType", bound=Section)


def load(path: Path, section: type[SectionType]) -> SectionType:
    """
    Read a configuration.

    Parameters
    ----------
    path : Path
        TOML file; paths in it are relative to its folder.
    section : type of Section
        What the file holds: :class:`Run` or :class:`Simulation`.

    Raises
    ------
    CatalogError
        If the file cannot be read, or naming every key that is unknown, missing or has a wrong value.
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
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise CatalogError(str(path), f"cannot be read as TOML: {error}") from error


def checked(
    section: type[SectionType], content: dict[str, object], source: str = "command line", folder: Path | None = None
) -> SectionType:
    """
    Return the settings of a section.

    Parameters
    ----------
    section : type of Section
        What the content belongs to.
    content : dict
        Key to value, as TOML gives it.
    source : str
        Where the content comes from, for the error.
    folder : Path, optional
        What paths are relative to.

    Raises
    ------
    CatalogError
        Naming every key that is unknown, missing or has a wrong value.
    """
    try:
        return section.model_validate(content, context=folder and {"folder": folder})
    except ValidationError as error:
        raise CatalogError(source, "; ".join(_fault(fault) for fault in error.errors())) from error


def _fault(fault: ErrorDetails) -> str:
    """Return one fault of a configuration: key, what is wrong, value."""
    key = ".".join(map(str, fault["loc"])) or "the file"
    given = "" if fault["type"] in {"missing", "value_error"} else f" (got {fault['input']!r:.60})"
    unknown = "unknown key" if fault["type"] == "extra_forbidden" else fault["msg"]
    return f"{key}: {unknown}{given}"
