"""
The page as a person uses it, in Chromium; its script and style are package data.

Its content comes from per_obspy.report.page.document and per_obspy.report.statements.
"""

import csv
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from per_obspy.report.results import Drawings, Revision

from .made_up import HOSTILE, page_data, pair_table, with_region

#: Seconds for 20 000 pairs, the best of some loads: other work of the machine only adds to it.
LONGEST_DRAWING = 0.3
LOADS = 4

#: A station for a drawing: a peak of 2 m/s² to the east.
STATION = {
    "start": 0.0, "step": 0.5, "north": [-1.0, 1.0, -0.5, 0.5], "east": [-0.1, 0.1, -0.2, 2.0],
    "period": [0.1, 1.0, 10.0], "per": [1.0, 20.0, 60.0], "sd": [1.0, 15.0, 30.0],
    "damping": 0.05, "usable": [0.2, 8.0],
}  # fmt: skip

#: Bytes of a page of a million pairs.
LARGEST_PAGE = 5_000_000


def test_first_screen_says_what_happened_and_what_to_do(opened):
    page = opened(page_data(pair_table(12)))
    assert page.page.title() == "A made-up quarter – per_obspy"
    assert "SIMULATED" in page.page.inner_text("#simulated")
    assert page.page.eval_on_selector("#simulated", "e => getComputedStyle(e).backgroundColor") == (
        "rgb(176, 0, 0)"
    )
    event = page.page.inner_text("#event")
    for fact in ("First record 2026-01-02 03:04.", "Magnitude 6.4."):
        assert fact in event
    # Probabilities fall evenly to 0: 6 of 12, and the three severe pairs are the first ones
    assert page.page.inner_text("#alert").startswith(
        "LEVEL: SEVERE. About 6 of 12 pairs (50 %) hit each other; "
    )
    assert page.page.eval_on_selector("#alert", "e => getComputedStyle(e).borderLeftColor") == (
        "rgb(127, 0, 0)"
    )
    assert page.page.inner_text("#status") == (
        "Issued 2026-01-02 04:12 UTC. Automatic, elastic, not reviewed: a later issue or an "
        "inspection replaces it."
    )
    levels = page.page.inner_text("#levels")
    assert "severe ≥ 0.5 m/s, high ≥ 0.2 m/s, moderate ≥ 0.05 m/s" in levels
    assert page.texts(".shares_legend span") == ["screened: 12"]
    expected = page.page.inner_text("#expected")
    assert expected == (
        "2 stations expected; 1 used: XX.A1; 1 missing or rejected: XX.B2 (clipped: 9 equal "
        "samples at an extreme)."
    )
    assert page.page.is_hidden("#revision")
    numbers = page.texts("#numbers dd")
    # 12 pairs; 6 expected, 3 of them sure and 9 at least possible; no gap is unknown
    assert numbers[0] == "6 (3–9)"
    assert numbers[2] == "0"
    assert len(numbers) == 4
    assert "P0000000, P0000001" in page.page.inner_text("#todo")
    assert "6 of 12 pairs have inputs that are derived" in page.page.inner_text("#sure")


def test_real_motion_is_not_called_simulated(opened):
    page = opened(with_region(page_data(pair_table(12)), simulated=False))
    assert page.page.is_hidden("#simulated")
    assert "SIMULATED" not in page.page.inner_text("body")


@pytest.mark.parametrize(
    ("field", "value", "passes"),
    [
        ("#probability", "50", lambda pair: pair["probability"] >= 0.5),
        ("#velocity", "0.4", lambda pair: pair["expected_impact_velocity"] >= 0.4),
        ("#search", "p0000007", lambda pair: pair["pair_id"] == "P0000007"),
        ("#search", "B15", lambda pair: pair["building_id_1"] == "B15"),
    ],
)
def test_filters_by_number_and_name(opened, field, value, passes):
    table = pair_table(30)
    page = opened(page_data(table))
    page.page.fill(field, value)
    assert page.column(2) == [pair["pair_id"] for _, pair in table.iterrows() if passes(pair)]
    page.page.click("#clear")
    assert len(page.column(2)) == 30


def test_filters_by_state_area_and_flag(opened):
    page = opened(page_data(pair_table(24)))
    page.page.uncheck("input[value='yes']")
    assert set(page.column(4)) == {"likely", "possible", "no"}
    page.page.select_option("#area", "harbour")
    assert page.column(2) == ["P0000006", "P0000012", "P0000018"]
    page.page.click("#filters summary")
    page.page.check("input[value='far_station']")
    assert page.column(2) == []
    assert page.page.inner_text("#count").startswith("0 of 24")


@pytest.mark.parametrize(
    ("kind", "passes"),
    [
        ("any", lambda flags: bool(flags & {"touching", "far_station"})),
        ("all", lambda flags: flags >= {"touching", "far_station"}),
        ("none", lambda flags: not flags & {"touching", "far_station"}),
    ],
)
def test_filter_takes_several_flags(opened, kind, passes):
    table = pair_table(12)
    texts = ["touching", "far_station", "touching far_station derived_inputs", "derived_inputs"]
    table["flags"] = [texts[row % 4] for row in range(12)]
    page = opened(page_data(table))
    page.page.click("#filters summary")
    page.page.check("input[value='touching']")
    page.page.check("input[value='far_station']")
    page.page.select_option("#flag", kind)
    names = [set(flags.split()) for flags in table["flags"]]
    expected = [pair for pair, flags in zip(table["pair_id"], names, strict=True) if passes(flags)]
    assert page.column(2) == expected
    assert page.page.inner_text("#filters summary") == "Flags: 2"
    page.page.click("#clear")
    assert len(page.column(2)) == 12


def test_search_by_name_of_a_place(opened):
    """Streets and towns of the inventory, of either building, areas and stations."""
    table = pair_table(12)
    table["addr:street_1"] = ["Calle 5" if row == 3 else "Avenida 2" for row in range(12)]
    table["city_2"] = ["Escazú" if row in (3, 7) else "San José" for row in range(12)]
    page = opened(page_data(table))
    for sought, rows in (("calle 5", [3]), ("escazú", [3, 7]), ("harbour", [0, 6])):
        page.page.fill("#search", sought)
        assert page.column(2) == [f"P{row:07}" for row in rows]
    page.page.fill("#search", "calle")
    page.page.click("#pairs tbody tr:first-child button")
    assert "Place: Calle 5, Escazú." in page.page.inner_text("#detail")


def test_search_by_place_finds_what_is_within_a_kilometre(opened):
    table = pair_table(200)
    table.loc[5, ["latitude", "longitude"]] = 50.0, 8.0
    page = opened(page_data(table))
    page.page.fill("#search", "50.001, 8.001")
    assert page.column(2) == ["P0000005"]


def test_table_sorts_both_ways_and_says_so(opened):
    page = opened(page_data(pair_table(30)))
    head = page.page.locator("th[data-column='gap']")
    head.locator("button").click()
    rising = [float(text) for text in page.column(7)]
    assert rising == sorted(rising)
    assert len(set(rising)) > 5
    assert head.get_attribute("aria-sort") == "ascending"
    head.locator("button").click()
    assert [float(text) for text in page.column(7)] == rising[::-1]
    assert head.get_attribute("aria-sort") == "descending"


def test_a_click_on_a_pair_tells_everything_about_it(opened):
    page = opened(page_data(pair_table(30)))
    page.page.click("#pairs tbody tr:first-child button")
    text = page.page.inner_text("#detail")
    for part in ("P0000000", "The probability of pounding in this event is 100 %", "3 impacts"):
        assert part in text
    # Two pairs of circles, and the history of the worst pair
    assert page.page.locator("#detail svg.picture").count() == 3
    assert page.page.locator("#detail svg.picture circle").count() == 4
    assert "gap 0: the single hit is outside its reliable range" in text
    assert "What would have prevented it" in text
    assert "period 1, period 2" in text
    page.page.click("#detail .close")
    assert page.page.is_hidden("#detail")


def test_circles_touch_the_gap_as_the_numbers_say(opened):
    """Radii are PER times participation: 13 and 52 cm, in the ratio of 1 to 4."""
    page = opened(page_data(pair_table(30)))
    page.page.click("#pairs tbody tr:first-child button")
    circles = page.page.locator("#detail svg.picture").first.locator("circle")
    radii = [float(circles.nth(i).get_attribute("r")) for i in range(2)]
    assert radii[1] == pytest.approx(4 * radii[0], rel=1e-3)  # numbers are stored with four digits


def test_a_click_on_the_map_chooses_the_pair_there(opened):
    table = pair_table(1)
    page = opened(page_data(table))
    box = page.page.locator("#map").bounding_box()
    # A single pair lies in the middle
    page.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert "P0000000" in page.page.inner_text("#detail h2")


def test_keys_alone_move_the_map_sort_and_open_a_pair(opened):
    page = opened(page_data(pair_table(30)))
    page.page.focus("#map")
    before = page.page.evaluate("document.getElementById('map').toDataURL()")
    page.page.keyboard.press("+")
    page.page.keyboard.press("ArrowLeft")
    page.page.wait_for_timeout(200)
    assert page.page.evaluate("document.getElementById('map').toDataURL()") != before
    page.page.focus("th[data-column='gap'] button")
    page.page.keyboard.press("Enter")
    assert page.page.get_attribute("th[data-column='gap']", "aria-sort") == "ascending"
    page.page.focus("#pairs tbody tr:first-child button")
    page.page.keyboard.press("Enter")
    assert page.page.evaluate("document.activeElement.id") == "detail"


def test_every_control_has_a_name_for_a_screen_reader(opened):
    page = opened(page_data(pair_table(30)))
    unnamed = page.page.evaluate(
        """[...document.querySelectorAll("button, input, select, canvas")].filter((control) => {
          const label = control.labels?.length ? control.labels[0].textContent : "";
          return !(label + (control.getAttribute("aria-label") || "") + control.innerText).trim();
        }).map((control) => control.outerHTML)"""
    )
    assert unnamed == []
    assert page.page.get_attribute("html", "lang") == "en"
    assert page.page.locator("h1").count() == 1


def exported(page):
    """Return the rows of the exported file."""
    with page.page.expect_download() as download:
        page.page.click("#export")
    text = download.value.path().read_text(encoding="utf-8-sig")
    return list(csv.DictReader(text.splitlines()))


def test_export_holds_what_is_filtered_in_its_order(opened):
    table = pair_table(30).assign(owner="A")
    page = opened(page_data(table))
    page.page.fill("#probability", "50")
    page.page.click("th[data-column='gap'] button")
    rows = exported(page)
    chosen = table[table["probability"] >= 0.5].sort_values("gap")
    assert [row["pair_id"] for row in rows] == chosen["pair_id"].to_list()
    # Numbers have the digits that are stored, two of what depends on the contact law
    for name, digits in (("gap", 4), ("expected_impact_velocity", 2)):
        numbers = [float(row[name]) for row in rows]
        assert numbers == [float(f"{value:.{digits}g}") for value in chosen[name]]
    # Other columns are in the table beside the page, which says so
    assert "owner" not in rows[0]
    assert "the Parquet table of these results has all of them" in page.page.inner_text("#list")


def outlined(names):
    """Return pairs, and square outlines of 20 m around the first buildings of them."""
    table = pair_table(len(names), names)
    places = zip(table["longitude_1"], table["latitude_1"], strict=True)
    half = 1e-4
    rings = [
        [x - half, y - half, x + half, y - half, x + half, y + half, x - half, y + half]
        for x, y in places
    ]
    return table, list(zip(table["building_id_1"], rings, strict=True))


def test_a_click_on_an_outline_chooses_its_worst_pair(opened):
    table, outlines = outlined(["A"])
    # Far from the line between the buildings, within the outline
    table["longitude_2"] = table["longitude_1"] + 1e-5
    table["longitude"] = table["longitude_1"]
    page = opened(page_data(table, outlines=outlines))
    page.page.focus("#map")
    x, y = page.page.evaluate(
        """() => { const box = document.getElementById("map").getBoundingClientRect();
          return [box.x + box.width / 2, box.y + box.height / 2]; }"""
    )
    # 50 m are half of the height of a map of one pair: outlines are drawn
    page.page.mouse.click(x - 40, y - 40)
    assert "Pair A" in page.page.inner_text("#detail h2")
    page.page.click("#detail .close")
    page.page.mouse.click(x - 400, y - 200)
    assert page.page.is_hidden("#detail")


def test_hostile_names_of_outlines_and_stations(opened):
    table, outlines = outlined(HOSTILE)
    stations = pd.DataFrame(
        {"station": HOSTILE, "state": "used", "longitude": 13.1, "latitude": 43.1}
    )
    drawn = dict.fromkeys(HOSTILE, STATION)
    drawings = Drawings(drawn)
    page = opened(page_data(table, outlines=outlines, stations=stations, drawings=drawings))
    for row in range(len(HOSTILE)):
        page.page.click(f"#pairs tbody tr:nth-child({row + 1}) td:nth-child(2) button")
        page.page.click(f"#stations tbody tr:nth-child({row + 1}) button")
        assert page.page.inner_text("#station h2").startswith("station ")
    assert page.page.locator("img, iframe, link, object, embed, [onerror]").count() == 0
    assert page.page.locator("script").count() == 2
    assert page.page.title() == "A made-up quarter – per_obspy"
    # Outlines are found by names as they are packed: those of all but the first are cut
    found = page.page.evaluate("document.querySelectorAll('#station svg').length")
    assert found == 2


def test_a_station_shows_record_spectra_and_warnings(opened):
    drawings = Drawings({"XX.A1": STATION})
    page = opened(page_data(pair_table(12), drawings=drawings))
    page.page.click("#stations tbody tr:first-child button")
    assert page.page.evaluate("document.activeElement.id") == "station"
    assert page.texts("#station figcaption") == [
        "Processed acceleration, m/s²: north above, east below",
        "PER (solid) and SD (dashed) at 5 % damping, cm, over the period, s",
    ]
    assert "No check of its record has failed." in page.page.inner_text("#station")
    # The peak of 2 m/s² to the east is drawn: 64 pixels from the middle of the second panel
    points = page.page.locator("#station polyline").nth(1).get_attribute("points")
    heights = [float(point.split(",")[1]) for point in points.split()]
    assert max(abs(height - 220) for height in heights) == pytest.approx(64, abs=0.1)
    page.page.click("#stations tbody tr:nth-child(2) button")
    assert "clipped: 9 equal samples" in page.page.inner_text("#station")


def test_sensitivity_of_a_pair(opened):
    rows = [["period_1", 0.4, 0.9, 0.3, 0.95, "possible", "yes"],
            ["gap", 0.0, 0.1, 1.0, 0.2, "yes", "possible"]]  # fmt: skip
    drawings = Drawings(sensitivity={1: rows}, worst=2, doubtful=1)
    table = pair_table(30).assign(derived="period_1 mass_2 gap")
    page = opened(page_data(table, drawings=drawings))
    page.page.click("#pairs tbody tr:first-child button")
    text = page.page.inner_text("#detail")
    assert "period 1\t0.40 s\t30 %, possible\t0.90 s\t95 %, sure" in text
    assert "gap\t0.0 cm\t100 %, sure\t10.0 cm\t20 %, possible" in text
    assert "No deviation is known of: mass 2." in text
    page.page.click("#pairs tbody tr:nth-child(9) button")
    text = page.page.inner_text("#detail")
    assert "Computed for the 2 worst pairs and the 1 most doubtful ones, not for this." in text
    # The page holds one history: how to get another one
    assert 'per-obspy show "#9" . -o pair.png' in text


def test_revision_is_shown(opened):
    revision = Revision(3, "2026-01-02 04:12")
    page = opened(page_data(pair_table(3), revision=revision))
    assert page.page.inner_text("#revision") == "Revision 3, 2026-01-02 04:12 UTC"


def test_what_a_screen_reader_is_given(opened):
    """The accessibility tree of the browser: heads, names, live regions and their order."""
    page = opened(page_data(pair_table(30)))
    tree = page.page.locator("body").aria_snapshot()
    for part in (
        '- note: "SIMULATED ground motion',
        '- heading "A made-up quarter" [level=1]',
        '- region "summary"',
        '- heading "What to do first" [level=2]',
        '- application "Map of the pairs. Arrow keys move it',
        '- group "severity"',
        '- checkbox "severe (8)" [checked]',
        '- spinbutton "probability from, %"',
        '- combobox "area"',
        '- searchbox "search"',
        "- status: 30 of 30 pairs of this page (30 screened)",
        '- button "export as CSV"',
        '- columnheader "rank"',
        '- columnheader "impact, m/s"',
    ):
        assert part in tree, part
    # A filter says how many pairs are left, a choice which pair it is
    page.page.fill("#search", "P0000007")
    assert "- status: 1 of 30 pairs" in page.page.locator("#list").aria_snapshot()
    page.page.click("#pairs tbody tr:first-child button")
    assert page.page.locator("#opened").inner_text().startswith("P0000007: ")
    detail = page.page.locator("#detail").aria_snapshot()
    assert '- rowheader "period, s"' in detail
    assert '- img "Circles of energy' in detail


def test_tab_walks_through_the_page_from_top_to_bottom(opened):
    page = opened(page_data(pair_table(30)))
    seen = []
    for _ in range(22):
        page.page.keyboard.press("Tab")
        seen.append(
            page.page.evaluate(
                """() => { const one = document.activeElement;
                  return [one.id || one.value || one.innerText, one.getBoundingClientRect().top
                    + window.scrollY]; }"""
            )
        )
    names = [name for name, _ in seen]
    assert names[:5] == ["to the table of pairs", "map", "nearer", "further", "whole"]
    assert {"probability", "velocity", "area", "search", "export"} <= set(names)
    # Never upwards by more than a row of controls: the order is that of the page
    tops = [top for _, top in seen[5:]]
    assert all(after > before - 60 for before, after in pairwise(tops))


def test_cells_follow_class_and_state_and_hide_from_other_filters(opened, monkeypatch):
    monkeypatch.setattr("per_obspy.report.tally.PAGE_PAIRS", 4)
    table = pair_table(40)
    data = page_data(table)
    page = opened(replace(data, worst=table.head(4)))
    picture = "document.getElementById('map').toDataURL()"
    whole = page.page.evaluate(picture)
    assert "They follow the filters" in page.page.inner_text("#cells")
    # All pairs that are drawn one by one are sure: without another state only cells change
    page.page.uncheck("input[value='no']")
    page.page.wait_for_timeout(100)
    fewer = page.page.evaluate(picture)
    assert fewer != whole
    page.page.check("input[value='no']")
    page.page.wait_for_timeout(100)
    assert page.page.evaluate(picture) == whole
    page.page.fill("#probability", "1")
    page.page.wait_for_timeout(100)
    assert "hidden now" in page.page.inner_text("#cells")
    assert page.page.evaluate(picture) not in (whole, fewer)


#: Texts that the map draws with white around them, and their boxes.
TOWNS = """() => {
  const [drawn, proto] = [[], CanvasRenderingContext2D.prototype];
  const own = proto.strokeText;
  proto.strokeText = function (...text) { drawn.push([...text, this.measureText(text[0]).width]); };
  window.dispatchEvent(new Event("beforeprint"));
  proto.strokeText = own;
  return drawn;
}"""


def test_map_names_the_largest_towns_and_draws_the_background(opened):
    data = page_data(pair_table(12))
    # Two at one place, of which the larger is named; then more than there is room for
    towns = [("Largest", 13.15, 43.09), ("Hidden", 13.15, 43.09)]
    towns += [(f"T{i}", 13.02 + 0.03 * (i % 6), 43.02 + 0.03 * (i // 6)) for i in range(36)]
    page = opened(replace(data, lines={"towns": towns}))
    drawn = page.page.evaluate(TOWNS)
    assert len(drawn) == 12
    assert drawn[0][0] == "Largest"
    assert "Hidden" not in [text for text, *_ in drawn]
    for (_, x1, y1, width1), (_, x2, y2, width2) in pairwise(sorted(drawn, key=lambda one: one[1])):
        assert abs(y1 - y2) > 10 or x1 + width1 < x2 or x2 + width2 < x1
    # A street of the user: first corner and steps of 1 m
    street = [[1_290_000, 4_320_500, 50_000, 0]]
    other = opened(replace(data, lines={"towns": towns, "background": street}))
    pictures = {
        one.page.evaluate("document.getElementById('map').toDataURL()") for one in (page, other)
    }
    assert len(pictures) == 2


def test_pairs_on_both_sides_of_the_date_line_are_neighbours(opened):
    table = pair_table(2).assign(latitude=-16.8, longitude=[179.99, -179.99])
    for name in ("longitude_1", "longitude_2"):
        table[name] = table["longitude"]
    table["latitude_1"] = table["latitude_2"] = -16.8
    page = opened(page_data(table))
    page.page.locator("#map").scroll_into_view_if_needed()
    box = page.page.locator("#map").bounding_box()
    # 88 % of the map, the western one left
    for side, name in ((-0.44, "P0000000"), (0.44, "P0000001")):
        page.page.mouse.click(box["x"] + (0.5 + side) * box["width"], box["y"] + box["height"] / 2)
        assert name in page.page.inner_text("#detail h2")


def test_names_from_right_to_left_leave_the_order_of_a_sentence(opened):
    data = page_data(pair_table(12, ["חיפה 12"]))
    page = opened(replace(data, areas=data.areas.assign(area=["חיפה", "ירושלים"])))
    # Each name, then its coordinates to the right of it
    places = page.page.evaluate(
        """() => [...document.querySelectorAll("#todo bdi")].map((name) => {
          const after = document.createRange();
          after.setStart(name.nextSibling, 0);
          after.setEnd(name.nextSibling, 6);
          const [one, two] = [name.getBoundingClientRect(), after.getBoundingClientRect()];
          return [one.top === two.top, two.left - one.right];
        })"""
    )
    assert len(places) == 3  # the worst pair and two areas
    assert all(abs(apart) < 3 for is_line, apart in places if is_line)
    button = page.page.locator("#pairs tbody tr:first-child button").first
    assert button.evaluate("e => getComputedStyle(e).direction") == "rtl"


def test_hostile_names_are_texts_and_no_formulas(opened):
    page = opened(with_region(page_data(pair_table(30, HOSTILE)), title=HOSTILE[0]))
    assert page.page.inner_text("h1") == HOSTILE[0]
    assert page.page.title().startswith("<script>")
    shown = page.column(2)
    assert shown[0] == HOSTILE[0]
    assert shown[1].startswith("</script><img")
    assert "\u202e" not in "".join(shown)
    assert max(map(len, shown)) <= 120
    # Nothing of a name has become an element, in the table or in the details
    for row in range(len(HOSTILE)):
        page.page.click(f"#pairs tbody tr:nth-child({row + 1}) td button")
    assert page.page.locator("img, iframe, link, object, embed, [onerror]").count() == 0
    assert page.page.locator("script").count() == 2
    cells = [cell for row in exported(page) for cell in row.values()]
    assert [cell for cell in cells if re.match(r"\s*[=+@]", cell)] == []
    assert "'=HYPERLINK" in "".join(cells)


def test_policy_forbids_requests_and_foreign_scripts(opened):
    page = opened(page_data(pair_table(3)))
    policy = page.page.get_attribute("meta[http-equiv='Content-Security-Policy']", "content")
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe" not in policy
    # A request that some code would make is refused by the browser, not only absent
    assert page.page.evaluate("fetch('https://example.org').then(() => 1, () => 0)") == 0
    assert any("Content Security Policy" in error for error in page.errors)
    page.errors.clear()


def test_prints_to_two_pages(opened):
    page = opened(with_region(page_data(pair_table(300, HOSTILE)), title="x" * 400))
    document = page.page.pdf(prefer_css_page_size=True)
    assert len(re.findall(rb"/Type\s*/Page\b(?!s)", document)) == 2


@pytest.mark.parametrize("width", [320, 400, 1280])
def test_no_width_makes_the_page_scroll_sideways(opened, width):
    page = opened(page_data(pair_table(60, HOSTILE)), width)
    page.page.click("#pairs tbody tr:nth-child(5) button")
    assert page.page.evaluate("document.documentElement.scrollWidth") <= width


def test_spanish(opened):
    page = opened(page_data(pair_table(30), "es"))
    assert page.page.get_attribute("html", "lang") == "es"
    assert page.texts("#todo li")[0].startswith("No envíe a nadie: el movimiento es simulado.")
    page.page.click("#pairs tbody tr:first-child button")
    detail = page.page.inner_text("#detail")
    assert "Qué lo habría evitado" in detail
    assert "severa; choque: seguro" in detail
    assert "período 1, período 2" in detail
    assert "estación lejana" in page.page.text_content("#filters")
    assert "saturado: 9 muestras iguales en un extremo" in page.page.inner_text("#stations")
    assert "1 usadas" not in page.page.inner_text("#expected")
    # Nothing of the page is left in English but names of data
    english = re.compile(r"\b(the|of|with|and|is|severe|moderate|high|low)\b")
    words = page.page.inner_text("main").replace("made with", "")
    words += page.page.inner_text("#alert") + page.page.inner_text("#levels")
    assert english.findall(words) == []


def measures(kind):
    """Return four pairs of one kind of page: to be mended, enough, in doubt, and of unknown gap."""
    table = pair_table(4).assign(
        state=["yes", "no", "possible", "unknown"],
        gap=[0.010, 0.300, 0.120, np.nan],
        demand=[0.347, 0.100, 0.080, 0.337],
        missing_gap=[0.337, 0.0, 0.0, np.nan],
        probability=[1.0, 1e-48, 0.3, np.nan],
        # What a run has for a pair that stays apart
        bumper_restitution=[0.4, 1.0, 1.0, np.nan],
        supplemental_damping=[np.nan, 0.0, 0.0, np.nan],
        risk_class=["severe", "low", "low", "gap unknown"],
    )
    of_record = ["supplemental_damping", "bumper_restitution", "impacts", "impact_velocity_exact"]
    if kind == "run":
        return table
    if kind == "shakemap":
        empty = dict.fromkeys(of_record, np.nan)
        return table.assign(station="", distance=np.nan, demand_rule="shakemap", **empty)
    if kind == "design":
        return table.assign(demand_rule="sd_srss").drop(columns=["station", "distance", *of_record])
    own = [
        "impact_velocity_84",
        "demand",
        "demand_rule",
        "missing_gap",
        "station",
        "distance",
        *of_record,
    ]
    return table.drop(columns=own).assign(worst_scenario="near fault")


#: Beginning of the sentences on the four pairs of each kind of page.
MEASURES = {
    "run": ["33.7 cm more gap, 34.7 cm in all", "None needed in this event: the gap is 30.0 cm",
            "The gap of 12.0 cm is enough for the likeliest", "The gap is unknown: measure it"],
    "shakemap": ["33.7 cm more gap, 34.7 cm in all", "None needed in this event",
                 "The gap of 12.0 cm is enough for the likeliest", "The gap is unknown"],
    "design": ["33.7 cm more gap, 34.7 cm in all", "None needed under this spectrum: the gap is 30",
               "The gap of 12.0 cm is enough for the likeliest", "The gap is unknown"],
    "ensemble": [*["Not computed for several scenarios together: see the results of the worst "
                   "one, near fault"] * 3, "The gap is unknown"],
}  # fmt: skip


@pytest.mark.parametrize("language", ["en", "es"])
@pytest.mark.parametrize("kind", MEASURES)
def test_none_needed_is_not_said_of_what_is_unknown_or_not_computed(opened, kind, language):
    """Catch a page that calls every pair of a spectrum, or of unknown gap, safe as it is."""
    stem = "risk" if kind in ("run", "shakemap") else kind
    source = ["A spectrum or a map."]
    data = page_data(measures(kind), language, stem=stem, drawings=Drawings(), source=source)
    page = opened(data)
    details = []
    for row in range(1, 5):
        page.page.click(f"#pairs tbody tr:nth-child({row}) button")
        details.append(page.page.inner_text("#detail"))
    english = ("in this event", "No measure", "None needed")
    spanish = ("no hace falta nada", "desconocida: mídala", "en este evento")
    for text, expected in zip(details, MEASURES[kind], strict=True):
        assert not re.search(r"rule_|prevents_|undefined|NaN| – cm", text)
        if language == "en":
            assert expected in text
            assert english[0] not in text or kind in ("run", "shakemap")
        else:
            assert not any(words in text for words in english)
    if language == "es":
        needs_none = [spanish[0] in text for text in details]
        assert needs_none == [False, kind != "ensemble", False, False]
        assert [spanish[1] in text for text in details] == [False, False, False, True]
        if kind in ("design", "ensemble"):
            assert not any(spanish[2] in text for text in details)
    # A pair of a record that stays apart needs no bumper of any kind
    assert "1.00 (" not in details[1]
    without_record = "without a record" in details[0] or "sin registro" in details[0]
    assert without_record == (kind in ("shakemap", "design"))


def test_a_small_probability_is_neither_zero_nor_fifty_decimals(opened):
    place = {"longitude": 13.1, "latitude": 43.1}
    tiny = pd.DataFrame({"area": ["a", "b"], "expected_pounding": [1e-48, 2.0], **place})
    page = opened(page_data(measures("run"), areas=tiny))
    assert page.column(5) == ["100", "< 0.1", "30", "–"]
    assert page.texts("#areas tbody td:nth-child(2)") == ["2", "< 0.001"]


def test_rest_of_the_page(opened):
    page = opened(page_data(pair_table(30)))
    assert page.texts("#stations tbody tr")[1].split("\t")[:2] == ["XX.B2", "rejected"]
    assert "clipped" in page.page.inner_text("#stations")
    assert page.texts("#areas tbody td:first-child") == ["centre", "harbour"]
    assert "gap: -1" in page.page.inner_text("#rejected")
    assert "per_obspy" in page.page.inner_text("#provenance")


def test_a_table_of_few_columns_has_a_page_too(opened):
    """As of a design spectrum: no station, no areas, no buildings, no classes of the default."""
    columns = ["rank", "pair_id", "state", "probability", "expected_impact_velocity", "gap"]
    columns += ["demand", "demand_rule", "longitude", "latitude", "per_1"]
    table = pair_table(30)[columns]
    nothing = pd.DataFrame()
    source = ["Screened by a spectrum."]
    data = page_data(table, stations=nothing, areas=nothing, drawings=Drawings(), source=source)
    page = opened(data)
    assert page.page.inner_text("#event") == "Screened by a spectrum."
    page.page.click("#pairs tbody tr:first-child button")
    assert "P0000000" in page.page.inner_text("#detail h2")
    assert page.page.is_hidden("#stations")


def drawing_seconds(page):
    """Return the shortest time of some loads from the parsed data to the drawn map, s."""
    seconds = []
    for _ in range(LOADS):
        page.page.reload()
        page.page.wait_for_selector("html[data-ready]", timeout=60_000)
        marks = page.page.evaluate(
            "['drawing', 'drawn'].map((name) => performance.getEntriesByName(name)[0].startTime)"
        )
        seconds.append((marks[1] - marks[0]) / 1000)
    return min(seconds)


def test_twenty_thousand_pairs_draw_at_once(opened):
    page = opened(page_data(pair_table(20_000)))
    assert drawing_seconds(page) < LONGEST_DRAWING
    assert page.page.inner_text("#count").startswith("20,000 of 20,000")
    page.page.fill("#search", "P0019999")
    assert page.column(2) == ["P0019999"]


def test_a_million_pairs_fit_into_a_small_page(opened):
    table = pair_table(1_000_000)
    page = opened(page_data(table))
    assert page.path.stat().st_size < LARGEST_PAGE
    assert page.texts(".shares_legend span") == ["screened: 1,000,000"]
    assert page.page.inner_text("#count").startswith("20,000 of 20,000")
    assert "The worst 20,000 of 1,000,000" in page.page.inner_text("#cells")
    assert drawing_seconds(page) < LONGEST_DRAWING
