"""Codes and names from data: none leads out of its folder."""

import pytest

from per_obspy.errors import CatalogError
from per_obspy.files import written_whole
from per_obspy.names import LONGEST_CODE, code_problem, inside

#: Names that lead out of a folder, or are no names on every system.
LEAVING = (
    "XX_/../../../victim.nc",
    "/etc/passwd",
    "..",
    ".",
    "",
    "a/../..",
    "XX.A\0.nc",
    "XX.A\n.nc",
    "..\\victim.nc",
    "C:victim.nc",
    "link/victim.nc",
    "linked.nc",
    "A" * 300 + ".nc",
)


@pytest.mark.parametrize("name", LEAVING)
def test_a_name_from_data_stays_in_its_folder(tmp_path, name):
    folder = tmp_path / "run" / "stations"
    folder.mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path)
    (folder / "linked.nc").symlink_to(tmp_path / "elsewhere.nc")
    with pytest.raises(CatalogError) as caught:
        inside(folder, name)
    # one line of a terminal or two
    assert len(str(caught.value)) < len(str(folder)) + 150
    assert "\n" not in str(caught.value)


def test_a_folder_may_be_a_link_itself(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "stations").symlink_to(tmp_path / "disk")
    assert inside(tmp_path / "stations", "CI.CLC.nc") == tmp_path / "stations" / "CI.CLC.nc"
    assert inside(tmp_path / "absent", "deep/CI.CLC.nc").parent.name == "deep"


@pytest.mark.parametrize(
    "codes", [("CI", "CLC"), ("", "TAFTLINCOLNSCHOOL"), ("BO", "AOM001", "", "EW1"), ("", "")]
)
def test_codes_of_real_records_name_files(codes):
    assert code_problem(*codes) == ""


@pytest.mark.parametrize(
    "codes",
    [
        ("XX_/../../..", "victim"),
        ("XX", "../victim"),
        ("XX", "a.b"),
        ("XX", "a b"),
        ("XX", "a\n"),
        ("XX", "a\0"),
        ("XX", "S\\1"),
        ("XX", "S001", "*", "HNE"),
        ("XX", "S001", "", "[/red]"),
        ("XX", "É"),
        ("XX", "A" * (LONGEST_CODE + 1)),
        ("XX", "A" * 1_000_000),
        ("no dot",),
    ],
)
def test_other_codes_have_a_short_reason(codes):
    assert 0 < len(code_problem(*codes)) < 150


def test_the_longest_codes_are_names_of_files(tmp_path):
    name = f"{'N' * LONGEST_CODE}.{'S' * LONGEST_CODE}.nc"
    # with process and machine around it while it is written
    with written_whole(inside(tmp_path, name)) as part:
        part.write_text("whole")
    assert (tmp_path / name).read_text() == "whole"
