"""Changes by ``--set``: values of TOML, text, paths of the shell, and the nearest key."""

from pathlib import Path

import pytest

from per_obspy.config import Run, checked, in_language
from per_obspy.config.commented import parsed_changes
from per_obspy.errors import CatalogError


@pytest.mark.parametrize(
    ("text", "content"),
    [
        ("screening.exact=false", {"screening": {"exact": False}}),
        ("spectra.dampings=[0.02, 0.05]", {"spectra": {"dampings": [0.02, 0.05]}}),
        ("processing.highpass = 0.1", {"processing": {"highpass": 0.1}}),
        # A word without quotes is text
        ("building.period_formula=ec8", {"building": {"period_formula": "ec8"}}),
        ("name=San José, 1985", {"name": "San José, 1985"}),
        ("name=a=b", {"name": "a=b"}),
        ('name="7"', {"name": "7"}),
        # Keys of a free table
        (
            'processing.fallback_highpass."3.5"=0.2',
            {"processing": {"fallback_highpass": {"3.5": 0.2}}},
        ),
        (
            "screening.classes={high=0.3, low=0}",
            {"screening": {"classes": {"high": 0.3, "low": 0}}},
        ),
    ],
)
def test_a_change_is_content_of_a_configuration(text, content):
    assert parsed_changes([text], Run) == content


def test_changes_join_and_the_later_one_counts():
    found = parsed_changes(["spectra.count=5", "spectra.longest=4.0", "spectra.count=6"], Run)
    assert found == {"spectra": {"count": 6, "longest": 4.0}}


def test_paths_are_seen_from_the_folder_of_the_shell(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = parsed_changes(["records.shakemap=grid.xml", "pairs={file='p.csv'}"], Run)
    assert found["records"]["shakemap"] == str(tmp_path / "grid.xml")
    assert found["pairs"]["file"] == str(Path.cwd() / "p.csv")
    table = "records.columns=[{file='a.txt', station='A'}]"
    (columns,) = parsed_changes([table], Run)["records"]["columns"]
    assert columns == {"file": str(tmp_path / "a.txt"), "station": "A"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "processing.highpas=1",
            "processing.highpas: unknown key, did you mean processing.highpass?",
        ),
        # The right name in the wrong place, and one that is deep inside
        ("highpass=1", "highpass: unknown key, did you mean processing.highpass?"),
        ("ntc_zone=II", "did you mean screening.codes.ntc_zone?"),
        ("screning.exact=true", "did you mean screening.exact?"),
        ("zzz=1", "zzz: unknown key; per-obspy init lists every key"),
        ("processing.checks.spike.levl='warn'", "did you mean processing.checks.spike.level?"),
        ("exact", "'exact': key=value on one line is expected"),
        ("=1", "key=value on one line is expected"),
        ("name=1\noutput='/etc'", "key=value on one line is expected"),
        ("a b=1", "'a b' is no dotted key"),
    ],
)
def test_a_wrong_change_is_one_line_with_the_nearest_key(text, message):
    with pytest.raises(CatalogError) as caught:
        parsed_changes([text], Run)
    assert message in str(caught.value)
    assert str(caught.value).startswith("--set: ")
    assert "\n" not in str(caught.value)


def test_another_language_keeps_the_rest_of_the_report():
    # would catch: --language loses the background of the map
    content = {"language": "es", "background": "a.pmtiles", "revision": 3}
    run = checked(Run, {"name": "a", "output": "b", "simulation": "c", "report": content})
    report = in_language(run, "en").report
    assert report == run.report.model_copy(update={"language": "en"})
    assert in_language(run, None) is run
