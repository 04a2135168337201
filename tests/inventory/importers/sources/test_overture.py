"""
Cells of sources whose tables need more than names.

Covers per_obspy.inventory.importers.sources.overture and
per_obspy.inventory.importers.sources.microsoft.
"""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
from building_samples import OUTLINES, overture, small_town

from per_obspy.inventory.footprints.footprint_pairs import pairs_from_footprints
from per_obspy.inventory.importers.recognition import imported


def test_a_building_under_the_ground_has_no_pairs(tmp_path):
    path = overture(tmp_path, small_town())
    assert len(pairs_from_footprints(path)) == 2
    table = pa.parquet.read_table(path)
    number = table.column_names.index("is_underground")
    below = pa.array([True, False, False, False])
    pa.parquet.write_table(table.set_column(number, "is_underground", below), path)
    pairs = pairs_from_footprints(path)
    assert pairs["building_id_1"].tolist() == ["b2"]
    reasons = [reason for row in pairs.attrs["rejected"] for reason in row.reasons]
    assert any("height_1 = 'underground'" in reason for reason in reasons)


def test_unknown_heights_of_microsoft_are_estimated_from_the_others():
    # 300 heights of log-deviation 0.4 about 8 m, one unknown
    known = 8.0 * np.exp(np.random.default_rng(1).normal(0, 0.4, 300))
    layer = pd.DataFrame({"height": [-1.0, *known], "confidence": -1.0})
    table = imported(layer, "town")
    # three deviations of a median of 300
    assert abs(np.log(table["height"].to_numpy()[0] / 8.0)) < 3 * 1.25 * 0.4 / np.sqrt(300)
    assert table["height_log_std"].notna().tolist() == [True] + [False] * 300


def test_every_source_is_recognised_by_its_own_sample():
    assert {source for source, _ in OUTLINES.values()} >= {"Overture Maps", "CityGML"}
