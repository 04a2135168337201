"""A configuration with help: every key is in it, and it loads to the same settings."""

import re
import tomllib
from pathlib import Path

import pytest

from per_obspy.config import Ensemble, Run, checked
from per_obspy.config.commented import commented, dotted_keys, effective_content

FOLDER = Path("/data/run")
MINIMAL = {"name": "x", "output": "out", "records": {"folder": "in"}, "pairs": {"file": "p.csv"}}
TABLE = {
    "file": "a.txt",
    "station": "A",
    "latitude": 1,
    "longitude": 2,
    "units": "g",
    "channels": {"HNN": 1},
    "dt": 0.01,
}
CONTENTS = [
    MINIMAL,
    # Text that needs quotes, tables in a list, free keys, a table without defaults
    MINIMAL | {"name": 'a "b" \\ ç\n# c'},
    MINIMAL | {"records": {"columns": [TABLE, TABLE | {"station": "B"}]}},
    MINIMAL | {"processing": {"fallback_highpass": {"-10.0": 0.5, "3.5": 0.2}}},
    MINIMAL | {"processing": {"checks": {"spike": {"threshold": 9, "level": "warn"}}}},
    MINIMAL | {"totals": {"h3": 8}, "screening": {"codes": {"ntc_zone": "II"}, "exact": False}},
    # An optional table with defaults only exists by its header
    MINIMAL | {"pairs": {"simulated": {}}},
    MINIMAL | {"pairs": {"footprints": {"file": "town.gpkg", "gap_std": 0.1}}},
    {"name": "x", "output": "out", "simulation": "scenario.toml"},
]


def _written(content):
    settings = checked(Run, content, folder=FOLDER)
    return settings, commented(Run, effective_content(settings, FOLDER), ["Heading"])


@pytest.mark.parametrize("content", CONTENTS)
def test_what_is_written_loads_to_the_same_settings(content):
    settings, text = _written(content)
    assert checked(Run, tomllib.loads(text), folder=FOLDER) == settings


def test_every_key_has_a_line_and_its_help():
    _, text = _written(MINIMAL)
    table, found = "", set()
    for line in text.splitlines():
        if header := re.match(r"#?\[+([\w.]+)\]+$", line):
            table = f"{header[1]}."
        elif key := re.match(r"#?(\w+) = ", line):
            found.add(f"{table}{key[1]}")
    # Tables are headers, and a check is a table on one line
    keys = set(dotted_keys(Run))
    inner = {key for key in keys if re.fullmatch(r"processing\.checks\.\w+\.\w+", key)}
    tables = {key for key in keys - inner if any(one.startswith(f"{key}.") for one in keys - inner)}
    assert found == keys - tables - inner
    assert "# high-pass corner, Hz; if not set, chosen for each record\n#highpass = ...\n" in text


def test_defaults_in_comments_are_the_defaults():
    # would catch a default that is written in another unit or form
    settings, text = _written(MINIMAL)
    lines = []
    for line in text.splitlines():
        is_open = re.match(r"#\w+ = \"?\.\.\.", line) or line.startswith("# ")
        lines += [] if is_open else [line.removeprefix("#")]
    # Optional sections are left out, and one way of counting totals is enough
    blocks = re.split(r"\n(?=\[)", "\n".join(lines))
    optional = r"\[+(records\.(columns|fdsn|sds|asdf)|pairs\.(footprints|simulated)|watch)\b"
    optional += r"|\[\[notify"
    kept = "\n".join(block for block in blocks if not re.match(optional, block))
    again = checked(Run, tomllib.loads(kept), folder=FOLDER)
    assert again == settings
    # many keys were set, not only the four that were given
    assert len(again.processing.model_fields_set) > 15


def test_help_is_marked_and_not_wider_than_a_screen():
    _, text = _written(MINIMAL)
    assert text.startswith("# Heading\n\n")
    for line in text.splitlines():
        if line.startswith("# "):
            assert len(line) <= 100


def test_other_models_are_written_too():
    text = commented(Ensemble, {"name": "e", "output": "o"}, [])
    assert tomllib.loads(text) == {"name": "e", "output": "o", "report": {}}
    assert "#[[scenario]]" in text
