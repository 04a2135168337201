"""The README's Python runs, and prints the documented output."""

import re
from pathlib import Path

CHECKOUT = Path(__file__).parents[1]


def test_the_python_of_the_readme_runs(capsys):
    (code,) = re.findall(
        r"```python\n(.*?)```", (CHECKOUT / "README.md").read_text(encoding="utf-8"), re.DOTALL
    )
    exec(compile(code, "README.md", "exec"), {})  # the point of this test
    said = capsys.readouterr().out
    assert re.fullmatch(r"buildings of 0\.5 s and 0\.8 s need a gap of \d+\.\d mm\n", said)


def test_the_first_screen_has_picture_commands_and_code():
    first = (CHECKOUT / "README.md").read_text(encoding="utf-8").splitlines()[:30]
    assert any(line.startswith("![") for line in first)
    assert any(line.startswith("make demo") for line in first)
    assert any("import obspy, per_obspy" in line for line in first)


def test_every_picture_of_the_readme_is_there():
    for name in re.findall(
        r"!\[.*?\]\((.*?)\)", (CHECKOUT / "README.md").read_text(encoding="utf-8")
    ):
        assert (CHECKOUT / name).is_file(), name
