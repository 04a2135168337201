"""
The page as a person uses it, in Chromium; its script and style are package data.

What it shows comes from per_obspy.report.page.document, per_obspy.report.page.content and
per_obspy.report.page.first_screen.
"""

import csv
import math
import re

import pandas as pd
import pytest

from per_obspy.report.page.first_screen import Event

from .made_up import HOSTILE, page_data, pair_table

#: Seconds for 20 000 pairs, the best of some loads: other work of the machine only adds to it.
LONGEST_DRAWING = 0.3
LOADS = 4

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
    for fact in (
        "Magnitude 6.4",
        "2026-01-02 03:04:05 UTC",
        "43.00°",
        "13.00°",
        "1 stations used, 1 not usable",
    ):
        assert fact in event
    assert "1 stations used, 1 not usable" in event
    numbers = page.texts("#numbers dd")
    # 12 pairs, 6 of them sure or likely, 3 severe; 6 expected: probabilities fall evenly to 0
    assert numbers[:4] == ["12", "6", "6", "3"]
    assert len(numbers) == 5
    assert "P0000000, P0000001" in page.page.inner_text("#todo")
    assert "6 of 12 pairs have inputs that are derived" in page.page.inner_text("#sure")


def test_real_motion_is_not_called_simulated(opened):
    page = opened(page_data(pair_table(12), simulated=False))
    assert page.page.is_hidden("#simulated")
    assert "SIMULATED" not in page.page.inner_text("body")


@pytest.mark.parametrize(
    ("field", "value", "passes"),
    [
        ("#probability", "50", lambda pair: pair["probability"] >= 0.5),
        ("#velocity", "40", lambda pair: pair["expected_impact_velocity"] >= 0.4),
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
    page.page.select_option("#flag", "far_station")
    assert page.column(2) == []
    assert page.page.inner_text("#count").startswith("0 of 24")


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
          const label = control.labels && control.labels.length ? control.labels[0].innerText : "";
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
    table = pair_table(30)
    page = opened(page_data(table))
    page.page.fill("#probability", "50")
    page.page.click("th[data-column='gap'] button")
    rows = exported(page)
    chosen = table[table["probability"] >= 0.5].sort_values("gap")
    assert [row["pair_id"] for row in rows] == chosen["pair_id"].to_list()
    gaps = [float(row["gap"]) for row in rows]
    assert gaps == pytest.approx(chosen["gap"].to_list(), rel=1e-3)  # four digits are stored


def test_hostile_names_are_texts_and_no_formulas(opened):
    page = opened(page_data(pair_table(30, HOSTILE), title=HOSTILE[0]))
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
    page = opened(page_data(pair_table(300, HOSTILE), title="x" * 400))
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
    assert page.texts("#todo li")[0] == "No envíe a nadie: el movimiento es simulado."
    page.page.click("#pairs tbody tr:first-child button")
    assert "Qué lo habría evitado" in page.page.inner_text("#detail")


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
    event = Event("", "", math.nan, None, 0, 0, "Screened by a spectrum.")
    data = page_data(table, stations=nothing, areas=nothing, histories={}, event=event)
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
    assert page.texts("#numbers dd")[0] == "1,000,000"
    assert page.page.inner_text("#count").startswith("20,000 of 20,000")
    assert "The worst 20,000 of 1,000,000" in page.page.inner_text("#cells")
    assert drawing_seconds(page) < LONGEST_DRAWING
