"""
Check a built site: every internal link leads somewhere, and no page asks the network for anything.

Usage: ``python check_site.py FOLDER``; prints every fault and exits with 1 if there is one.
"""

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

#: Elements that a browser fetches without a click -> the attribute with the address.
FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}

#: Links of this kind in the head are not fetched.
NOT_FETCHED = {"canonical", "next", "prev", "search", "index", "author", "copyright"}


class Page(HTMLParser):
    """Links, fetched addresses and anchors of one page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what an element links to, fetches and names."""
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        address = values.get(FETCHED.get(tag, ""))
        if address and not NOT_FETCHED & set(values.get("rel", "").split()):
            self.fetched.append(address)


def faults(site: Path) -> Iterator[str]:
    """Yield each link without a target and each address outside the site that is fetched."""
    files = (path for path in site.rglob("*.html") if "_static" not in path.parts)  # templates
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in files}
    for path, page in pages.items():
        name = path.relative_to(site)
        for address in page.fetched:
            if urlsplit(address).netloc:
                yield f"{name}: fetches {address}"
        for address in {*page.links, *page.fetched}:
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                yield f"{name}: no {address}"
                continue
            anchors = pages[target].anchors if target in pages else set()
            if target in pages and parts.fragment and unquote(parts.fragment) not in anchors:
                yield f"{name}: no anchor {address}"


def main() -> None:
    """Print the faults of the site that is named."""
    site = Path(sys.argv[1]).resolve()
    found = list(faults(site))
    print("\n".join(found) if found else f"all links of {site.name} lead somewhere")
    raise SystemExit(bool(found))


if __name__ == "__main__":
    main()
