"""
Every default of a run, with its unit and where it comes from; read from TOML.

Only runs and commands see a configuration as a whole. Rooms below take plain arguments
or one section. Paths in a configuration are relative to the folder of its file.
"""

from per_obspy.config.engine import Engine
from per_obspy.config.pairs import Pairs, Rows, Scenario, SimulatedPairs, Simulation, TableForm
from per_obspy.config.processing import Check, Checks, Processing, Spectra
from per_obspy.config.records import Archives, Asdf, Columns, Fdsn, Records, Sds, Window
from per_obspy.config.run import Design, Ensemble, EnsembleScenario, Run, screening_kind
from per_obspy.config.screening import (
    Building,
    Codes,
    Interpolation,
    ReportTexts,
    Screening,
    States,
    Totals,
    in_language,
)
from per_obspy.config.section import RelativePath, Section, checked, load
from per_obspy.config.watch import Notify, Reach, Watch

__all__ = [
    "Archives",
    "Asdf",
    "Building",
    "Check",
    "Checks",
    "Codes",
    "Columns",
    "Design",
    "Engine",
    "Ensemble",
    "EnsembleScenario",
    "Fdsn",
    "Interpolation",
    "Notify",
    "Pairs",
    "Processing",
    "Reach",
    "Records",
    "RelativePath",
    "ReportTexts",
    "Rows",
    "Run",
    "Scenario",
    "Screening",
    "Sds",
    "Section",
    "SimulatedPairs",
    "Simulation",
    "Spectra",
    "States",
    "TableForm",
    "Totals",
    "Watch",
    "Window",
    "checked",
    "in_language",
    "load",
    "screening_kind",
]
