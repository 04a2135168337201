"""Pages that are made from the code name everything: keys, commands, columns, public names."""

import importlib.util
import re
import sys

import api_pages
import check_site
import column_pages
import command_pages
import configuration_pages
import pandas as pd
import pytest
from blocks import ROOT, pages

import per_obspy
from per_obspy.inventory.schema import COLUMNS
from per_obspy.screening.columns import ORDER
from per_obspy.screening.meanings import FLAGS


@pytest.fixture(scope="module")
def generated(tmp_path_factory):
    """Folder of the generated pages."""
    folder = tmp_path_factory.mktemp("generated")
    for made in (api_pages, column_pages, command_pages, configuration_pages):
        made.write(folder)
    return folder


def test_every_key_of_every_configuration_has_a_line_with_help(generated):
    text = (generated / "configuration.md").read_text(encoding="utf-8")
    everything = {line.split(" | ")[0].strip("| `") for line in text.splitlines()}
    missing = [
        f"{section.__name__}.{name}"
        for section, name, field in configuration_pages.fields()
        if name not in everything and f"{name}]" not in text
    ]
    assert missing == []
    assert "`largest_distance` | `20000.0` | m | > 0, ≤ 2e+07 |" in text


def test_every_key_that_is_no_table_has_help():
    without = [
        f"{section.__name__}.{name}"
        for section, name, field in configuration_pages.fields()
        if not field.description and not list(configuration_pages.sections_of(field.annotation))
    ]
    assert without == []


def test_every_command_and_option_is_listed(generated):
    text = (generated / "commands.md").read_text(encoding="utf-8")
    for name, command in command_pages.commands():
        assert f"## `per-obspy {name}`" in text
        for parameter in command.params:
            if parameter.param_type_name == "option" and not parameter.hidden:
                assert parameter.opts[0] in text
    assert "## `per-obspy pairs check`" in text
    assert "## `per-obspy run`" in text


def test_every_column_and_flag_is_listed(generated):
    risk = (generated / "risk_columns.md").read_text(encoding="utf-8")
    pairs = (generated / "pair_columns.md").read_text(encoding="utf-8")
    assert [name for name in (*ORDER, *FLAGS) if f"`{name}`" not in risk] == []
    assert [name for name in COLUMNS if f"`{name}`" not in pairs] == []


def test_every_public_name_is_listed(generated):
    listed = (generated / "api.rst").read_text(encoding="utf-8").split()
    assert set(per_obspy.__all__) - {"__version__"} <= set(listed)


def test_every_page_is_reached_from_the_first_one():
    # would catch a page that no toctree names
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    names = [
        page.relative_to(ROOT / "docs").with_suffix("").as_posix()
        for page in pages()
        if page.parent != ROOT and page.stem != "index"
    ]
    assert [name for name in names if f"\n{name}\n" not in text] == []


def test_every_module_and_function_that_the_architecture_names_is_there():
    # would catch a page that was renamed, or a step that moved to another room
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:\w+/)+(?:\w+\.\w+)?)(?::(\w+))?`", text)
    package = ROOT / "per_obspy"
    missing = [p for p, _ in named if not ((package / p).exists() or (ROOT / p).exists())]
    missing += [
        f"{path}:{name}"
        for path, name in named
        if name and not re.search(rf"(def|class) {name}\b", (package / path).read_text("utf-8"))
    ]
    assert len(named) > 60
    assert missing == []


def test_the_readme_has_at_most_120_lines_and_names_the_three_users():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 120
    for page in ("assessment", "planner", "scheduled"):
        assert f"(docs/start/{page}.md)" in text
    assert "(docs/index.md)" in text
    assert "docs/figures/page_1280.png" in text


def test_links_to_nowhere_and_addresses_outside_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<a href="b.html#here">b</a><a href="c.html">c</a><a href="b.html#gone">b</a>'
        '<script src="https://example.org/x.js"></script><link rel="canonical" href="https://e.org">'
    )
    (tmp_path / "b.html").write_text('<p id="here">b</p>')
    assert sorted(check_site.faults(tmp_path)) == [
        "a.html: fetches https://example.org/x.js",
        "a.html: no anchor b.html#gone",
        "a.html: no c.html",
    ]


def test_the_gallery_has_eight_to_twelve_programs_with_titles():
    programs = sorted((ROOT / "docs" / "gallery").glob("plot_*.py"))
    assert 8 <= len(programs) <= 12
    for program in programs:
        title = compile(program.read_text(encoding="utf-8"), program, "exec").co_consts[0]
        assert title.splitlines()[2].startswith("="), program


def test_the_docstring_of_the_package_lists_the_public_names():
    # if it fails: python docs/extensions/public_names.py
    specification = importlib.util.find_spec("public_names")
    assert specification is not None
    import public_names

    assert public_names.listing() in per_obspy.__doc__


def test_ipython_completes_every_public_name(monkeypatch):
    from IPython.core.completer import IPCompleter, provisionalcompleter
    from IPython.core.interactiveshell import InteractiveShell

    # it warns of an environment that is active but not that of the tests
    monkeypatch.delenv("VIRTUAL_ENV", raising=False)
    shell = InteractiveShell.instance()
    try:
        shell.user_ns["per_obspy"] = per_obspy
        completer = IPCompleter(shell=shell, namespace=shell.user_ns, use_jedi=False)
        with provisionalcompleter():
            found = {one.text for one in completer.completions("per_obspy.", 10)}
    finally:
        InteractiveShell.clear_instance()
        sys.excepthook = sys.__excepthook__
    names = {name for name in per_obspy.__all__ if name != "__version__"}
    assert {f".{name}" for name in names} <= found or names <= found


def test_the_rows_of_the_readme_are_those_of_the_demonstration():
    made = ROOT / "output" / "demo" / "risk.csv"
    if not made.is_file():
        pytest.skip("the demonstration is not done: make demo, which CI does before the tests")
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    lines = text.partition("| rank | pair_id |")[2].splitlines()[2:5]
    table = pd.read_csv(made, nrows=3)
    for line, (_, row) in zip(lines, table.iterrows(), strict=True):
        rank, pair, severity, state, *rest = line.strip("| ").split(" | ")
        impact, configuration, weighted, gap, demand = rest
        assert configuration == row["configuration"]
        assert [int(rank), pair, severity, state] == [
            *row[["rank", "pair_id", "risk_class", "state"]]
        ]
        # the page shows five digits; compilers may change the last ones after many impacts
        shown = [float(value) for value in (impact, weighted, gap, demand)]
        names = ["expected_impact_velocity", "weighted_velocity", "gap", "demand"]
        found = row[names].astype(float)
        assert shown == pytest.approx(found.tolist(), rel=1e-3)
