"""Pictures of the README are drawn by the code of today: their names and sizes are compared."""

import importlib.util
import re
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.image import imread
from screening_samples import make_station

from per_obspy.report.pair_figure import draw_record_to_pair

ROOT = Path(__file__).parents[2]
PAIR = {
    "pair_id": "P7",
    "azimuth_used": 30.0,
    "damping_1": 0.05,
    "gap": 0.05,
    "demand": 0.123,
    "period_1": 1.0,
    "per_1": 0.2,
    "participation_1": 1.2,
    "period_2": 0.6,
    "per_2": 0.1,
    "participation_2": 0.9,
}


@pytest.fixture
def script(monkeypatch):
    # It imports another workflow
    monkeypatch.syspath_prepend(ROOT / "workflows")
    path = ROOT / "workflows" / "readme_figures.py"
    specification = importlib.util.spec_from_file_location("readme_figures", path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_every_picture_of_the_readme_is_made_by_the_script(script):
    pictures = re.findall(r"!\[[^]]*\]\(docs/figures/([^)]+)\)", (ROOT / "README.md").read_text())
    assert pictures
    # the picture of the page is one of a browser, taken as docs/page.md describes
    assert set(pictures) <= {*script.FIGURES, "page_1280.png"}
    assert all((ROOT / "docs" / "figures" / name).exists() for name in script.FIGURES)


def test_the_picture_of_a_pair_has_the_size_of_a_new_one(script, tmp_path):
    # would catch a picture of an earlier version
    draw_record_to_pair(make_station(), pd.Series(PAIR), tmp_path / "walk.png")
    assert script.FIGURES["walk.png"] == "worst_pair.png"
    old = imread(ROOT / "docs" / "figures" / "walk.png")
    assert old.shape == imread(tmp_path / "walk.png").shape
