"""The shape of the package: folders of at most twelve files, mirrored tests, unique stems."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted(
    path.relative_to(ROOT / "per_obspy")
    for path in (ROOT / "per_obspy").rglob("*.py")
    if path.stem not in ("__init__", "__main__")
)

#: One file per format: homogeneous on purpose.
LARGER_FOLDERS = {"formats"}

#: Stems that occur in several rooms, because these rooms mirror each other layer by layer.
MIRRORED = {
    *("run", "pairs", "records", "screening", "station", "ensemble", "totals", "evaluation"),
    *("spectra", "risk", "demand", "single_hit", "probability", "links", "row_history"),
    *("kriging", "bilinear", "building_rows", "buildings", "status", "watch"),
}


def _named_in_tests() -> str:
    """Return the docstrings of all test modules as one text."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return "\n".join(ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "" for path in files)


def test_no_folder_holds_more_than_twelve_modules():
    folders = defaultdict(list)
    for module in MODULES:
        folders[module.parent.as_posix()].append(module.name)
    assert {
        name: len(files)
        for name, files in folders.items()
        if len(files) > 12 and name not in LARGER_FOLDERS
    } == {}


@pytest.mark.parametrize("room", sorted({module.parts[0] for module in MODULES}))
def test_every_module_has_a_test_of_its_name_or_is_named_in_one(room):
    named = _named_in_tests()
    missing = [
        module.as_posix()
        for module in MODULES
        if module.parts[0] == room
        and not (ROOT / "tests" / module.with_name(f"test_{module.name}")).exists()
        and f"per_obspy.{module.with_suffix('').as_posix().replace('/', '.')}" not in named
    ]
    assert missing == []


def test_a_stem_occurs_once_or_mirrors_another_room_on_purpose():
    places = defaultdict(list)
    for module in MODULES:
        places[module.stem].append(module.as_posix())
    repeated = {stem: files for stem, files in places.items() if len(files) > 1}
    assert {stem: files for stem, files in repeated.items() if stem not in MIRRORED} == {}
