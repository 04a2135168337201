"""Figures before they are written."""

import importlib

import pytest


@pytest.fixture
def drawn(monkeypatch):
    """Return a function that makes a module of the report keep its figures instead of writing."""

    def drawn(module):
        figures = []
        monkeypatch.setattr(
            importlib.import_module(f"per_obspy.report.{module}"),
            "save",
            lambda figure, path, simulated, *_: figures.append((figure, path, simulated)),
        )
        return figures

    return drawn
