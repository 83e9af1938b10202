"""The documents as a site: the search of pages in a folder, and what axe-core finds."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from textwrap import dedent

import pytest
from axe_playwright_python.sync_playwright import Axe
from browser import PHONE, ROOT

PAGE = """
# Costmaps

See [the other page](other.md). A costmap has an `inflation_radius`, see [`footprint`](other.md).

```yaml
# a comment, and a line that is wider than the screen of any phone that is held upright
inflation_radius: 0.55  # metres, "text", true
```

```python
def wide(reach: float = 3.0) -> None:
    print(reach)
```

| name | unit |
| --- | --- |
| [`reach`](other.md) | m |

## A part

### A part of it
"""


def violations(page):
    # Without preload, axe does not ask for the styles, which pages of a folder are not given.
    return Axe().run(page, options={"preload": False}).response["violations"]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Two pages with the settings, styles, scripts and hook of ``make docs``."""
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(ROOT / "docs" / "javascripts", folder / "docs" / "javascripts")
    shutil.copytree(ROOT / "docs" / "stylesheets", folder / "docs" / "stylesheets")
    (folder / "docs" / "index.md").write_text(PAGE)
    (folder / "docs" / "other.md").write_text("# Other\n\n## Named\n\n### Twice\n")
    (folder / "hook.py").write_text("from docs_site import on_post_page\n")
    (folder / "mkdocs.yml").write_text(
        dedent(f"""\
            INHERIT: {ROOT / "mkdocs.yml"}
            nav: [{{Home: index.md}}, {{More: [other.md, {{Nested: [other.md]}}]}}]
            hooks: [hook.py]
            not_in_nav: ""
            """)
    )
    subprocess.run(
        [
            sys.executable,
            "-m",
            "mkdocs",
            "build",
            "--quiet",
            "--config-file",
            folder / "mkdocs.yml",
        ],
        env={**os.environ, "PYTHONPATH": str(ROOT / "scripts"), "NO_MKDOCS_2_WARNING": "1"},
        check=True,
    )
    return (folder / "site" / "index.html").as_uri()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [{}, PHONE], ids=["screen", "phone"])
def test_pages_of_a_folder_are_searched_and_axe_finds_nothing(open_page, site, size, scheme):
    page = open_page(site, color_scheme=scheme, reduced_motion="reduce", **size)
    page.locator(".md-code__nav").first.wait_for(state="attached")
    assert violations(page) == []

    if size:
        page.locator("label.md-header__button[for=__search]").click()
    page.locator(".md-search__input").press_sequentially("inflation")
    found = page.locator(".md-search-result__link").first
    found.wait_for()
    assert violations(page) == []
    found.click()
    page.wait_for_url("**/index.html?h=inflation*")


def test_links_in_a_text_are_underlined(open_page, site):
    link = open_page(site).get_by_role("link", name="the other page")
    assert "underline" in link.evaluate("link => getComputedStyle(link).textDecoration")
