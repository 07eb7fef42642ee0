"""Links of a site that was built: pages, places in them, files; addresses of others if asked."""

from __future__ import annotations

import urllib.error
import urllib.request
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The places of a page, and what it refers to."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.places: set[str] = set()
        self.targets: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if value is None:
                continue
            if name == "id":
                self.places.add(value)
            elif name in ("href", "src"):
                self.targets.add(value)


def broken(site: Path) -> tuple[list[str], set[str]]:
    """What leads nowhere, and the addresses that lead out."""
    pages = {path.resolve(): Page(path) for path in sorted(site.rglob("*.html"))
             if "_static" not in path.relative_to(site).parts}
    found, outside = [], set()
    for path, page in pages.items():
        for target in sorted(page.targets):
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                if parts.scheme in ("http", "https"):
                    outside.add(target.split("#")[0])
                continue
            other = (path.parent/unquote(parts.path)).resolve() if parts.path else path
            if other.is_dir():
                other /= "index.html"
            place = unquote(parts.fragment)
            if not other.exists() or place and other in pages and place not in pages[other].places:
                found.append(f"{path.relative_to(site.resolve())}: {target}")
    return found, outside


def unanswered(addresses: set[str]) -> list[str]:
    """Addresses whose server says that there is no such page; one that is out of reach is passed
    over, with a word."""
    found = []
    for address in sorted(addresses):
        request = urllib.request.Request(address, method="HEAD", headers={"User-Agent": "emcon"})
        try:
            urllib.request.urlopen(request, timeout=10).close()
        except urllib.error.HTTPError as problem:
            if problem.code in (404, 410):
                found.append(f"{address}: {problem.code}")
        except OSError as problem:
            print(f"not reached: {address}: {problem}")
    return found
