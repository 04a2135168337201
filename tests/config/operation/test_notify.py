"""The section ``[notify]``."""

import pytest

from per_obspy.config import Notify, checked
from per_obspy.errors import CatalogError


def test_without_a_way_or_an_occasion_it_is_silent():
    assert Notify().is_silent
    assert Notify(on=(), command=("mail",)).is_silent
    assert not Notify(command=("mail",)).is_silent


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ({"on": ["sometimes"]}, "on.0"),
        ({"command": [" "]}, "the program, is empty"),
        ({"command": ["a\0b"]}, "NUL"),
        ({"apprise_urls_variable": "a b"}, "apprise_urls_variable"),
        ({"apprise_urls_variable": "A", "apprise_urls_file": "b"}, "give either"),
        ({"timeout": 0}, "timeout"),
    ],
)
def test_wrong_values_are_named(content, problem):
    with pytest.raises(CatalogError, match=problem):
        checked(Notify, content)
