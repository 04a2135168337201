"""Settings of rows of buildings: defaults follow from the table and the screening; ranges."""

import pytest

from per_obspy.config import Run, load
from per_obspy.config.pairs import Rows
from per_obspy.errors import CatalogError


def test_by_default_the_pair_table_and_the_screening_decide():
    assert (Rows().enabled, Rows().exact) == (None, None)


@pytest.mark.parametrize(
    "line",
    ["angle = 0", "angle = 90", "angle = -1", "longest = 2", "longest = 201", "exact = 3", "x = 1"],
)
def test_what_cannot_be_is_refused_with_its_name(tmp_path, line):
    file = tmp_path / "run.toml"
    file.write_text(f'name = "a"\noutput = "o"\nsimulation = "s"\n[rows]\n{line}\n')
    with pytest.raises(CatalogError, match=line.split(maxsplit=1)[0]):
        load(file, Run)
