"""Configurations as TOML with the help of every key, from the models of the sections."""

import json
import textwrap
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args, get_origin

import tomlkit
from pydantic.fields import FieldInfo

from per_obspy.config.section import Section, sections_of, with_paths
from per_obspy.errors import CatalogError, printable, shortened

#: Where changes come from, in messages.
OPTION = "--set"


def parsed_changes(texts: Sequence[str], section: type[Section]) -> dict[str, Any]:
    """
    Return changes as content of a configuration, with paths seen from the folder of the shell.

    Parameters
    ----------
    texts : sequence of str
        Each ``key=value`` with a dotted key. The value is one of TOML; other values are text.
    section : type of Section
        Model of the configuration.

    Raises
    ------
    CatalogError
        If a text is no such pair, its key is unknown, or two keys contradict each other.
    """
    content: dict[str, Any] = {}
    for text in texts:
        change = _parsed(text)
        keys = _path(text, section)
        _require_known(keys, section)
        content = merged(content, with_paths(change, section, lambda path: str(Path.cwd() / path)))
    return content


def merged(content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return the content of a configuration with changes, table by table.

    Examples
    --------
    >>> merged({"spectra": {"count": 10}, "name": "a"}, {"spectra": {"longest": 5.0}})
    {'spectra': {'count': 10, 'longest': 5.0}, 'name': 'a'}
    """
    result = dict(content)
    for key, value in changes.items():
        known = result.get(key)
        if isinstance(known, Mapping) and isinstance(value, Mapping):
            result[key] = merged(known, value)
        else:
            result[key] = value
    return result


def dotted_keys(section: type[Section], prefix: str = "") -> Iterator[str]:
    """Yield every key of a configuration with the names of its tables."""
    for name, field in section.model_fields.items():
        yield f"{prefix}{name}"
        for inner in sections_of(field.annotation):
            yield from dotted_keys(inner, f"{prefix}{name}.")


def _parsed(text: str) -> dict[str, Any]:
    """Return one change as content."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip() or printable(text) != text:
        raise CatalogError(OPTION, f"{shortened(text, 80)!r}: key=value on one line is expected")
    # A word that is no value of TOML is text
    try:
        return tomllib.loads(f"{key} = {value}")
    except (tomllib.TOMLDecodeError, RecursionError):
        pass
    try:
        return tomllib.loads(f"{key} = {json.dumps(value.strip(), ensure_ascii=False)}")
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        reason = f"{shortened(key, 80)!r} is no dotted key, such as screening.codes.ntc_zone"
        raise CatalogError(OPTION, reason) from error


def _path(text: str, section: type[Section]) -> list[str]:
    """Return the names of a dotted key, those inside a table of free keys left out."""
    content: Any = tomllib.loads(f"{text.partition('=')[0]} = 0")
    names = []
    while isinstance(content, dict):
        ((name, content),) = content.items()
        names.append(name)
    # Names inside a table of free keys are no keys of the configuration
    model: type[Section] | None = section
    for depth, name in enumerate(names):
        if model is None or name not in model.model_fields:
            return names if model is not None else names[:depth]
        model = next(sections_of(model.model_fields[name].annotation), None)
    return names


def _require_known(names: Sequence[str], section: type[Section]) -> None:
    """Raise CatalogError with the nearest key if a dotted key is unknown."""
    key, known = ".".join(names), list(dotted_keys(section))
    if key not in known:
        nearest = nearest_key(key, known)
        advice = f", did you mean {nearest}?" if nearest else "; per-obspy init lists every key"
        raise CatalogError(OPTION, f"{shortened(key, 80)}: unknown key{advice}")


def nearest_key(key: str, known: Sequence[str]) -> str:
    """
    Return the known dotted key that is most like another one, empty if none is.

    Examples
    --------
    >>> nearest_key("highpas", ["name", "processing.highpass"])
    'processing.highpass'
    """
    # The last name decides, wherever it belongs; of several places the most similar one
    last = {one: one.rpartition(".")[2].lower() for one in known}
    name = key.rpartition(".")[2].lower()
    alike = get_close_matches(name, set(last.values()), n=1, cutoff=0.7)
    places = [one for one in known if alike and last[one] == alike[0]]
    nearest = get_close_matches(key, places or known, n=1, cutoff=0.0 if places else 0.7)
    return nearest[0] if nearest else ""


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
        repeated = Ellipsis in get_args(field.annotation)
        entries: list[Mapping[str, Any]] = list(given or []) if repeated else [given or {}]
        # A table that exists without its header loses nothing by it
        is_set = given is not None or (isinstance(field.default, Section) and _all_default(model))
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


def _all_default(model: type[Section]) -> bool:
    """Return whether every key of a table has a default."""
    return not any(field.is_required() for field in model.model_fields.values())


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
