"""Contents of report pages, for their tests."""

from __future__ import annotations

import base64
import json
import re
from hashlib import sha256
from html import unescape
from html.parser import HTMLParser

from quad_nav.report.plot import plot_scripts


class Parsed(HTMLParser):
    """Every attribute that could load something, the sections and the open elements."""

    LOADING = {"src", "href", "srcset", "data", "action", "poster", "background"}
    VOID = {"meta", "img", "br", "link", "input"}

    def __init__(self, html: str):
        super().__init__()
        self.loads, self.sections, self._open = [], [], []
        self.feed(html)
        assert self._open == []

    def handle_starttag(self, tag, attributes):
        self.loads += [value for name, value in attributes if name in self.LOADING]
        self.sections += [value for name, value in attributes if tag == "section" and name == "id"]
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag


def assert_loads_nothing(html: str) -> None:
    """Nothing but our scripts runs, and plotly.js loads nothing that the policy forbids."""
    texts = plot_scripts().texts if 'class="plot"' in html else ()
    for text in texts:
        assert html.count(f"<script>{text}</script>") == 1
        html = html.replace(text, "")
    assert html.count("<script") == len(texts) + html.count('<script type="application/json" id=')
    assert all(value.startswith("data:image/png;base64,") for value in Parsed(html).loads)
    assert not re.search(r"url\(|@import|<link|<iframe", html)
    policy = re.search('Content-Security-Policy" content="([^"]*)"', html).group(1)
    hashes = [base64.b64encode(sha256(text.encode()).digest()).decode() for text in texts]
    assert unescape(policy).split("; ") == [
        "default-src 'none'",
        " ".join(
            ["script-src", *(f"'sha256-{one}'" for one in hashes)]
            if texts
            else ["script-src 'none'"]
        ),
        "style-src 'unsafe-inline'",
        "img-src data: blob:",
        "base-uri 'none'",
        "form-action 'none'",
    ]


def figures_of(html: str):
    """The plots of a page by their names."""
    pattern = r'<script type="application/json" id="figure-plot-(\w+)">(.*?)</script>'
    return {name: json.loads(text) for name, text in re.findall(pattern, html)}
