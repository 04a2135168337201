"""
A configuration that is wrong is refused with file, key and value.

Covers ``per_obspy.config.run``, ``per_obspy.config.records``, ``per_obspy.config.processing``,
``per_obspy.config.screening``, ``per_obspy.config.pairs`` and ``per_obspy.config.run``.
"""

from pathlib import Path

import pytest

from per_obspy.config import Ensemble, Run, Simulation, checked, load, screening_kind
from per_obspy.errors import CatalogError

GOOD = 'name = "x"\noutput = "out"\n[records]\nfolder = "in"\n[pairs]\nfile = "pairs.csv"\n'
#: a table of samples without its interval
TABLE = (
    '{file = "a", station = "A", latitude = 1, longitude = 2, units = "g", channels = {HNN = 1}}'
)
CHECKOUT = Path(__file__).parents[2]


def _load(tmp_path, text):
    file = tmp_path / "run.toml"
    file.write_text(text)
    return load(file, Run)


def test_paths_are_relative_to_the_file(tmp_path):
    settings = _load(tmp_path, GOOD)
    assert settings.output == tmp_path / "out"
    assert settings.records.folder == tmp_path / "in"


def test_what_a_run_says_of_itself_holds_no_absolute_path(tmp_path):
    said = _load(tmp_path, GOOD).model_dump_json(context={"folder": tmp_path})
    assert str(tmp_path) not in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            GOOD + "[processing]\nhighpas = 0.1\n",
            r"run\.toml: processing\.highpas: unknown key \(got 0\.1\)",
        ),
        (
            GOOD + "[processing]\nhighpass = -1\n",
            r"processing\.highpass: .*greater than 0 \(got -1\)",
        ),
        (
            GOOD + "[processing]\nhighpass = 10.0\nlowpass = 1.0\n",
            r"highpass = 10 Hz must be below lowpass = 1 Hz",
        ),
        (
            GOOD + "[processing]\nrequired_band = [10.0, 0.2]\n",
            r"two rising frequencies above 0, got 10 and 0\.2 Hz",
        ),
        (
            GOOD + "[screening]\nclasses = { high = 2.0, low = 1.0 }\n",
            r"screening\.classes: .*the last threshold must be 0 m/s",
        ),
        (
            GOOD + "[screening]\nclasses = { high = 1.0, low = 2.0 }\n",
            r"screening\.classes: .*\(m/s\) must be in descending order",
        ),
        (
            GOOD + "[screening.states]\nlikely = 0.95\n",
            r"screening\.states: .*yes > likely > possible > unlikely is required, got 0\.9, 0\.95",
        ),
        (
            GOOD + "[screening.states]\nunlikely = 0.0\n",
            r"screening\.states\.unlikely: .*greater than 0 \(got 0\.0\)",
        ),
        (
            GOOD + "[screening.states]\nyes = 1.5\n",
            r"screening\.states\.yes: .*less than or equal to 1 \(got 1\.5\)",
        ),
        (
            GOOD + "[screening]\npossible_from = 0.1\n",
            r"screening\.possible_from: unknown key",
        ),
        (
            GOOD + "[screening]\nclasses = { high = nan }\n",
            r"screening\.classes\.high: .*finite number \(got nan\)",
        ),
        (
            GOOD + "[spectra]\ndampings = [5.0]\n",
            r"spectra\.dampings\.0: .*less than 1 \(got 5\.0\), expected: dampings of",
        ),
        (GOOD + "[spectra]\ndampings = []\n", r"spectra\.dampings: .*at least 1 item"),
        (
            GOOD + "[spectra]\ndampings = [0.2, 0.05]\n",
            r"spectra\.dampings: must rise, got 0\.2, 0\.05",
        ),
        (
            GOOD + "[spectra]\ndampings = [0.1, 0.2]\n",
            r"spectra\.dampings must reach from 0\.05 .* got 0\.1, 0\.2",
        ),
        (GOOD + "[spectra]\ndampings = [0.05, 0.05]\n", r"spectra\.dampings: must rise"),
        (
            GOOD + "[spectra]\nshortest = 5.0\nlongest = 1.0\n",
            r"spectra: shortest = 5 s must be below longest = 1 s",
        ),
        (
            GOOD + "[spectra]\nlongest = inf\n",
            r"spectra\.longest: .*finite number \(got inf\), expected: longest period",
        ),
        (GOOD + "[spectra]\nazimuth_step = 7\n", r"spectra\.azimuth_step: must divide 180 degrees"),
        (
            GOOD + "[building]\nstorey_height = 3000\n",
            r"building\.storey_height: .*12 \(got 3000\), expected: height of a storey .*, m$",
        ),
        (
            GOOD + "[building]\ndamping = 5\n",
            r"building\.damping: .*less than 1 \(got 5\), expected: damping of .*of critical",
        ),
        (GOOD + "[totals]\ncell = 0.5\n", r"totals\.cell: .*equal to 1 \(got 0\.5\)"),
        (GOOD + "[totals]\nh3 = 16\n", r"totals\.h3: .*less than or equal to 15 \(got 16\)"),
        (
            GOOD + '[totals]\nh3 = 8\narea = "ward"\n',
            r"totals: .*give one of cell, area and h3, got area, h3",
        ),
        (
            GOOD + "[totals]\ncell = 1000.0\nh3 = 8\n",
            r"totals: .*give one of cell, area and h3, got cell, h3",
        ),
        (GOOD.replace('name = "x"\n', ""), r"name: Field required"),
        (GOOD.replace("[records]", "[record]"), r"record: unknown key"),
        (
            GOOD.replace(
                'folder = "in"',
                'columns = [{file = "a", station = "A", units = "furlong", channels = {}}]',
            ),
            r"records\.columns\.0\.units: 'furlong' is no unit of acceleration, such as",
        ),
        (
            GOOD.replace('folder = "in"', f"columns = [{TABLE}]"),
            r"records\.columns\.0: give exactly one of time_column and dt",
        ),
        (
            GOOD.replace('folder = "in"', f'columns = [{TABLE[:-1]}, dt = 0.1, layout = "no"}}]'),
            r"records\.columns\.0\.layout: .*\(got 'no'\), expected: order of the samples",
        ),
        (
            GOOD.replace('folder = "in"', f'columns = [{TABLE[:-1]}, dt = 0.1, layout = "rows"}}]'),
            r"records\.columns\.0: layout = \"rows\" holds one channel.*got .*HNN.*: 1",
        ),
        (
            GOOD.replace('folder = "in"\n', ""),
            r"records: give at least one of folder, columns, fdsn",
        ),
        (
            GOOD.replace(
                'folder = "in"',
                'fdsn = {providers = ["x"], cache = "c", event_id = "e", after = 1e12}',
            ),
            r"records\.fdsn\.after: .*to 86400 \(got 1000000000000\.0\), expected: time from",
        ),
        (GOOD + 'simulation = "s.toml"\n', r"pairs\.simulation: unknown key"),
        ('simulation = "s.toml"\n' + GOOD, r"give either simulation or records"),
        (
            'name = "x"\noutput = "o"\nsimulation = "s"\n[pairs]\n',
            r"pairs: .*give one of file, footprints, catalog and simulated",
        ),
        (GOOD.split("[pairs]")[0], r"give pairs"),
        (
            GOOD.replace("[records]", '[records]\nshakemap_uncertainty = "u.xml"'),
            r"belongs to a shakemap: give both",
        ),
        ("name = ", r"run\.toml: cannot be read as TOML"),
        ('name = "\xff"', r"name"),
    ],
)
def test_every_fault_names_key_and_value(tmp_path, text, message):
    with pytest.raises(CatalogError, match=message):
        _load(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[processing]\nhighpas = 0.1\n",
            r"processing\.highpas: unknown key \(got 0\.1\), did you mean highpass\?$",
        ),
        ("[Totals]\ncell = 100.0\n", r"Totals: unknown key .*, did you mean totals\?$"),
        (
            "[screening.code]\nntc_zone = 'I'\n",
            r"screening\.code: unknown key .*, did you mean codes\?$",
        ),
        (
            "[processing.checks.spikes]\nthreshold = 1\n",
            r"checks\.spikes: unknown key .*, did you mean spike\?$",
        ),
        (
            "[processing.checks]\nspike = { threshold = 1, leval = 'note' }\n",
            r"leval: unknown key .*mean level\?$",
        ),
        ("[screening]\nzzz = 1\n", r"screening\.zzz: unknown key \(got 1\)$"),
    ],
)
def test_an_unknown_key_is_asked_about(tmp_path, text, message):
    # would catch a suggestion from another section than the one in which the key stands
    with pytest.raises(CatalogError, match=message):
        _load(tmp_path, GOOD + text)


def test_keys_of_a_list_of_sections_are_asked_about(tmp_path):
    file = tmp_path / "ensemble.toml"
    file.write_text(
        'name = "x"\noutput = "o"\n[[scenario]]\nname = "a"\nrun = "a.toml"\nrates = 0.1\n'
    )
    with pytest.raises(
        CatalogError, match=r"scenario\.0\.rates: unknown key \(got 0\.1\), did you mean rate\?$"
    ):
        load(file, Ensemble)


@pytest.mark.parametrize(
    ("second", "message"),
    [
        (
            "rate = -0.1",
            r"scenario\.1\.rate: .*greater than or equal to 0 \(got -0\.1\), expected: .*1/year",
        ),
        ("rate = nan", r"scenario\.1\.rate: .*\(got nan\)"),
        ("weight = 0.5", r"'b' has a weight, others have the other one"),
        ("", r"'b' needs either a weight or a rate"),
    ],
)
def test_what_an_ensemble_cannot_weigh(tmp_path, second, message):
    file = tmp_path / "ensemble.toml"
    scenario = '[[scenario]]\nname = "{}"\nrun = "{}.toml"\n{}\n'
    text = scenario.format("a", "a", "rate = 0.1") + scenario.format("b", "b", second)
    file.write_text(f'name = "x"\noutput = "o"\n{text}')
    with pytest.raises(CatalogError, match=message):
        load(file, Ensemble)


def test_weights_need_not_sum_to_one_but_to_more_than_nothing(tmp_path):
    file = tmp_path / "ensemble.toml"
    text = 'name = "x"\noutput = "o"\n[[scenario]]\nname = "a"\nrun = "a.toml"\nweight = {}\n'
    file.write_text(text.format(3.0))
    assert load(file, Ensemble).weights == {"a": 3.0}
    file.write_text(text.format(0.0))
    with pytest.raises(CatalogError, match="positive sum, all are 0"):
        load(file, Ensemble)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CatalogError, match=r"absent\.toml: cannot be read"):
        load(tmp_path / "absent.toml", Run)


@pytest.mark.parametrize(
    "path", sorted((CHECKOUT / "workflows").glob("*.toml")), ids=lambda path: path.name
)
def test_the_workflows_are_valid(path):
    assert load(path, screening_kind(path)).name


def test_the_demo_scenario_is_what_the_readme_says():
    simulation = load(CHECKOUT / "catalogs" / "demo" / "scenario.toml", Simulation)
    assert (
        simulation.scenario.magnitude,
        simulation.scenario.stations,
        simulation.scenario.seed,
    ) == (7.0, 24, 20)
    assert simulation.pairs.count == 2000


def test_an_empty_path_is_refused():
    # would catch results in the folder of the configuration itself
    with pytest.raises(CatalogError, match="output: the path is empty: name a file or folder"):
        checked(Run, {"name": "a", "output": "", "simulation": "b.toml"})


def _unlimited(schema, name=""):
    """Yield the numbers of a schema that have no upper limit."""
    limits = {"maximum", "exclusiveMaximum"}
    if isinstance(schema, list):
        for part in schema:
            yield from _unlimited(part, name)
    elif isinstance(schema, dict):
        if schema.get("type") in ("number", "integer") and not limits & schema.keys():
            yield name
        for key, part in schema.items():
            yield from _unlimited(part, name if key in ("anyOf", "items") else f"{name}.{key}")


def test_every_number_has_an_upper_limit():
    # 1e12 s after an earthquake, or a million workers, once ended in a traceback, or hours later
    schemas = {**Run.model_json_schema(), "ensemble": Ensemble.model_json_schema()}
    assert not list(_unlimited([schemas, Simulation.model_json_schema()]))
