"""Changes of a configuration on the command line: dotted keys with values of TOML."""

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

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
