"""Page as one HTML file with its style, script and data."""

import hashlib
import re
from base64 import b64encode
from importlib.resources import files
from pathlib import Path

from per_obspy.files import written_whole
from per_obspy.report.page.content import page_content
from per_obspy.report.page.packing import encoded
from per_obspy.report.results import Results

#: Parts of the script, in their order.
SCRIPTS = ("data.js", "map.js", "list.js", "details.js", "stations.js", "page.js")


def write_page(results: Results, path: Path) -> None:
    """
    Write the page, whole or not at all.

    Parameters
    ----------
    results : Results
        Everything that it shows.
    path : Path
        ``report.html``.
    """
    document = page_document(results)
    with written_whole(path) as part:
        part.write_text(document, encoding="utf-8", newline="\n")


def page_document(results: Results) -> str:
    """
    Return the page as HTML.

    Texts of data are only in the block of data, whose letters cannot be markup, and the script sets
    them as texts. The policy allows only the page's own script and style, by their hashes: no
    request leaves the browser.
    """
    content, tables = page_content(results)
    style, script = _asset("page.css"), "\n".join(_asset(name) for name in SCRIPTS)
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "base-uri 'none'; form-action 'none'"
    )
    # Every part goes into its place once; none is searched for places
    parts = {
        "language": results.language,
        "policy": policy,
        "style": style,
        "script": script,
        "data": encoded(content, tables),
    }
    return re.sub(r"@(\w+)@", lambda found: parts[found[1]], _asset("page.html"))


def _asset(name: str) -> str:
    """Read a file of the page from the package."""
    return (files("per_obspy.report.page") / "assets" / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    """Return the hash of a script or style for the content security policy."""
    return f"sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
