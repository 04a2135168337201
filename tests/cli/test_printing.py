"""Tables on the console: text of data is literal, numbers are short."""

import pytest

from per_obspy.cli.printing import cell, print_table, shown_progress


@pytest.mark.parametrize("text", ["[/red]", "[red]x", ":smile:", "[link=http://x]y[/link]", "$x_$"])
def test_text_of_data_is_literal(capsys, text):
    # would catch markup that ends in an error or disappears
    print_table(text, [text], [[text]])
    assert capsys.readouterr().out.count(text) == 3


def test_no_character_steers_the_terminal(capsys):
    hostile = "a\x1b]0;title\x07b\u202ec\nd"
    print_table(hostile, [hostile], [[hostile]])
    output = capsys.readouterr().out
    assert not {"\x1b", "\x07", "\u202e"} & set(output)
    assert cell(hostile) == "a ]0;title b c d"


def test_numbers_have_three_digits_and_missing_ones_none():
    assert [cell(value) for value in (1.23456, float("nan"), 7, "x")] == ["1.23", "", "7", "x"]


def test_progress_outside_of_a_terminal_is_a_line_per_step(capsys):
    with shown_progress() as progress:
        progress("[/red]", 1, 2)
    assert capsys.readouterr().err == "[/red]: 1 of 2\n"
