"""The README's Python runs, and prints the documented output."""

import re
import subprocess
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


def test_the_demonstration_ends_with_a_command_that_is_there():
    """Catch a next step that the shell does not find: only .venv has the command."""
    # The tests may be a command of make themselves
    asked = ["make", "--no-print-directory", "--dry-run", "--old-file=.venv/run", "demo"]
    lines = subprocess.run(asked, cwd=CHECKOUT, capture_output=True, text=True, check=True).stdout
    last = lines.splitlines()[-1].removeprefix('echo "').strip(' "')
    assert last.startswith(".venv/bin/per-obspy run RECORDS PAIRS")
    assert "source .venv/bin/activate" in lines
    assert "source .venv/bin/activate" in (CHECKOUT / "README.md").read_text(encoding="utf-8")


def test_nobody_is_sent_to_an_index_that_has_no_release():
    """`pip install per_obspy` without an extra finds nothing before a release."""
    pages = [CHECKOUT / "README.md", *(CHECKOUT / "docs").rglob("*.md")]
    pattern = re.compile(r"pip install '?per_obspy(?:\[[a-z,]+\])?'?(?P<rest>[^\n]*)")
    found = [match for page in pages for match in pattern.finditer(page.read_text("utf-8"))]
    # Said to find nothing, or to add libraries where the package is
    known = ("` finds nothing", "` adds the libraries", "`, which adds the libraries")
    assert [match[0] for match in found if not match["rest"].startswith(known)] == []
    assert len(found) == 3
