"""A page in a real browser: Chromium of the system, without network."""

import os
import shutil

import pytest

from per_obspy.report.page.document import write_page


def unavailable(reason):
    """Fail in CI, where the browser is part of the machine; skip by name elsewhere."""
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def chromium():
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        unavailable("needs Chromium: apt-get install chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        unavailable("needs playwright: pip install per_obspy[browser]")
    with sync_playwright() as driver:
        # Containers have no right to make the sandbox
        browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()


class Opened:
    """A page in the browser, with everything that it asked of the network and complained about."""

    def __init__(self, page):
        self.page, self.requests, self.errors = page, [], []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", lambda message: self.errors.append(message.text))

    def texts(self, selector):
        return self.page.locator(selector).all_inner_texts()

    def column(self, number):
        return self.texts(f"#pairs tbody td:nth-child({number})")


@pytest.fixture
def opened(chromium, tmp_path):
    """Open pages; at the end none has made a request or an error."""
    contexts, pages = [], []

    def open_page(data, width=1280):
        path = tmp_path / f"report{len(pages)}.html"
        write_page(data, path)
        context = chromium.new_context(viewport={"width": width, "height": 900})
        context.set_offline(True)
        contexts.append(context)
        pages.append(Opened(context.new_page()))
        pages[-1].page.goto(path.as_uri())
        pages[-1].page.wait_for_selector("html[data-ready]", timeout=60_000)
        pages[-1].path = path
        return pages[-1]

    yield open_page
    for page in pages:
        # The file itself is the only request, however often it is loaded
        assert set(page.requests) == {page.path.as_uri()}
        assert page.errors == []
    for context in contexts:
        context.close()
