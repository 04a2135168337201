"""
Work of the regular expressions of headers, and the length of the lines that reach them.

Covers ``per_obspy.formats`` and every module in it.
"""

import importlib
import io
import pkgutil
import re
from re import _constants as codes
from re import _parser as parser

import pytest
from format_samples import SAMPLES, Sample
from obspy.core.util.base import ENTRY_POINTS
from obspy.core.util.misc import buffered_load_entry_point

import per_obspy.formats
from per_obspy.errors import RecordRejected
from per_obspy.formats.text.lines import LONGEST_LINE

#: repeats with a larger limit count as unbounded: they can take a whole line of a file
UNBOUNDED = 100

#: unbounded repeats of a pattern that can give back what they took: with two the work grows with
#: the square of the line, which has 2000 characters at most; three or more once took hours
MOST_REPEATS = 2


def patterns() -> dict[str, str]:
    """Return the names of all compiled patterns of the formats with their texts."""
    found = {}
    for module in pkgutil.walk_packages(per_obspy.formats.__path__, "per_obspy.formats."):
        for name, value in vars(importlib.import_module(module.name)).items():
            for pattern in value.values() if isinstance(value, dict) else [value]:
                if isinstance(pattern, re.Pattern):
                    found[f"{module.name}.{name} {pattern.pattern[:12]}"] = pattern.pattern
    return found


PATTERNS = patterns()


def repeats(parts) -> int:
    """Return the number of unbounded repeats on one path that are not possessive or atomic."""
    number = 0
    for code, value in parts:
        if code in (codes.MAX_REPEAT, codes.MIN_REPEAT):
            number += (value[1] >= UNBOUNDED) + repeats(value[2])
        elif code is codes.SUBPATTERN:
            number += repeats(value[-1])
        elif code is codes.BRANCH:
            number += max(map(repeats, value[1]))
        elif code in (codes.ASSERT, codes.ASSERT_NOT):
            number += repeats(value[1])
    return number


def test_the_counter_sees_what_a_pattern_gives_back():
    for text, number in ((r"(.*?)\s*\(a\s*", 3), (r"(.*?)\s*+\(a\s*+", 1), (r"(?>a*)b{1,9}", 0)):
        assert repeats(parser.parse(text)) == number


@pytest.mark.parametrize("name", PATTERNS)
def test_no_pattern_tries_a_line_in_many_ways(name: str):
    assert repeats(parser.parse(PATTERNS[name])) <= MOST_REPEATS


@pytest.mark.parametrize("sample", SAMPLES.values(), ids=SAMPLES)
def test_long_header_lines_are_refused_before_they_are_searched(sample: Sample):
    point = ENTRY_POINTS["waveform"][sample.name]
    group = f"obspy.plugin.waveform.{sample.name}"
    plugin = [
        buffered_load_entry_point(point.dist.name, group, name)
        for name in ("isFormat", "readFormat")
    ]
    lines = sample.text.split("\n")
    # A run of a letter that patterns repeat, in the middle of every line of the header
    for line in range(min(len(lines), 30)):
        words = lines[line][:20] + " 1A."[line % 4] * 10**6 + lines[line][20:]
        content = "\n".join([*lines[:line], words, *lines[line + 1 :]]).encode("latin-1")
        plugin[0](io.BytesIO(content))
        with pytest.raises(RecordRejected, match=f"line {line + 1}, line: .* at most") as refusal:
            plugin[1](io.BytesIO(content))
        assert len(str(refusal.value)) < LONGEST_LINE
