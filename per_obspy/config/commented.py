"""Configurations as TOML with the help of every key, from the models of the sections."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args, get_origin

import tomlkit
from pydantic.fields import FieldInfo

from per_obspy.config.section import Section, sections_of

#: Columns of a comment.
WIDTH = 96

#: Placeholder of a value that has no default.
OPEN = "..."


def commented(section: type[Section], content: Mapping[str, Any], heading: Sequence[str]) -> str:
    """
    Return a configuration with every key of its model and its help.

    Parameters
    ----------
    section : type of Section
        Model of the configuration.
    content : mapping
        Key to value, as TOML gives it; only these keys are set. All others are comments: with
        their default, or with ``...`` where they have none.
    heading : sequence of str
        Lines of the comment at the top.

    Returns
    -------
    text : str
        TOML. Lines that start with ``# `` are help; a key or section that starts with ``#`` alone
        is set by removing this character.
    """
    top = [_comment(line) for line in heading]
    return "\n".join([*top, "", *_keys(section, content), *_tables(section, content, "")]) + "\n"


def effective_content(settings: Section, folder: Path) -> dict[str, Any]:
    """Return the settings that differ from their defaults, with paths seen from a folder."""
    content: dict[str, Any] = settings.model_dump(
        mode="json", context={"folder": folder}, exclude_defaults=True
    )
    return content


def _comment(text: str) -> str:
    """Return text as lines of a comment."""
    lines = textwrap.wrap(text, WIDTH, break_on_hyphens=False) or [""]
    return "\n".join(f"# {line}".rstrip() for line in lines)


def _keys(section: type[Section], content: Mapping[str, Any]) -> Iterator[str]:
    """Yield help and value of every key of a table that is no table itself."""
    for name, field in section.model_fields.items():
        if _model(field) is not None:
            continue
        if field.description:
            yield _comment(field.description)
        given = name in content
        value = _toml(content[name]) if given else _default(field)
        yield f"{'' if given else '#'}{name} = {value}"


def _tables(section: type[Section], content: Mapping[str, Any], prefix: str) -> Iterator[str]:
    """Yield every table inside a table, set ones first where it is repeated."""
    for name, field in section.model_fields.items():
        model = _model(field)
        if model is None:
            continue
        # A repeated table has one block per entry
        path, given = f"{prefix}{name}", content.get(name)
        repeated = _is_repeated(field)
        entries: list[Mapping[str, Any]] = list(given or []) if repeated else [given or {}]
        is_set = given is not None or _has_default(field, model)
        for entry in entries or [{}]:
            block = _block(field, model, entry, (path, repeated))
            shown = is_set and bool(entries)
            yield from block if shown else map(_switched_off, block)


def _block(
    field: FieldInfo, model: type[Section], entry: Mapping[str, Any], place: tuple[str, bool]
) -> list[str]:
    """Return the lines of one table, from its help to the tables inside."""
    # Help, header, keys, then the tables inside
    path, repeated = place
    meaning = field.description or (model.__doc__ or "").strip().partition("\n")[0]
    header = f"[[{path}]]" if repeated else f"[{path}]"
    keys = [line for text in _keys(model, entry) for line in text.split("\n")]
    inner = [line for text in _tables(model, entry, f"{path}.") for line in text.split("\n")]
    return ["", *_comment(meaning).split("\n"), header, *keys, *inner]


def _switched_off(line: str) -> str:
    """Return a line as a comment."""
    return line if not line or line.startswith("#") else f"#{line}"


def _model(field: FieldInfo) -> type[Section] | None:
    """Return the model of a table, None for a plain value; a table without defaults is one."""
    model = next(sections_of(field.annotation), None)
    if model is None:
        return None
    is_inline = isinstance(field.default, Section) and not _all_default(model)
    return None if is_inline else model


def _has_default(field: FieldInfo, model: type[Section]) -> bool:
    """Return whether a table exists without its header, so that the header has no effect."""
    return isinstance(field.default, Section) and _all_default(model)


def _all_default(model: type[Section]) -> bool:
    """Return whether every key of a table has a default."""
    return not any(field.is_required() for field in model.model_fields.values())


def _is_repeated(field: FieldInfo) -> bool:
    """Return whether a table may stand several times."""
    return Ellipsis in get_args(field.annotation)


def _default(field: FieldInfo) -> str:
    """Return the default of a key as TOML, or the placeholder if it has none."""
    if field.is_required() or field.get_default(call_default_factory=True) is None:
        return f'"{OPEN}"' if _is_text(field.annotation) else OPEN
    return _toml(field.get_default(call_default_factory=True))


def _is_text(annotation: Any) -> bool:
    """Return whether a key holds text or a path."""
    is_group = get_origin(annotation) in (tuple, dict)
    return annotation in (str, Path) or (
        not is_group and any(map(_is_text, get_args(annotation)[:1]))
    )


def _toml(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, Section):
        value = value.model_dump(mode="json")
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_toml, value))}]"
    if not isinstance(value, Mapping):
        return str(tomlkit.item(value).as_string())
    # A table on one line
    names = [tomlkit.key(str(key)).as_string() for key in value]
    values = map(_toml, value.values())
    pairs = [f"{name} = {one}" for name, one in zip(names, values, strict=True)]
    return f"{{ {', '.join(pairs)} }}" if pairs else "{}"
