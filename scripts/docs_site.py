"""Complete the documentation site with pages from outside of ``docs/``: a hook of mkdocs.

* README.md is the index; CONTRIBUTING.md and CHANGELOG.md have a page each.
* A link to any other file or folder of the repository leads to a page that shows it, so that links
  work in the site as they do in a view of the repository.
* Each package of ``quad_nav`` has a page of the API reference.
* The examples of ``docs/python.md`` run; one that fails ends the build.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path, PurePosixPath
from typing import Any, Dict, List

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "quad_nav"
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
# [text](target) and ![text](target), the anchor apart; links with a scheme are not ours.
LINK = re.compile(r"(\]\()(?![a-z]+:)([^)#\s]+)(#[^)\s]*)?(\))")
# Lists of links within a list of links: the theme makes landmarks of them, many of the same name.
NESTED_NAV = re.compile(r'(<nav class="md-nav"(?: data-md-level="\d")?) aria-label[^>]*>')
EXAMPLES = ROOT / "docs" / "python.md"
EXAMPLE = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def on_pre_build(config: MkDocsConfig) -> None:
    """Run the examples for Python, all at the same time.

    Raises:
        PluginError: An example fails.
    """
    text = EXAMPLES.read_text(encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    runs = []
    for example in EXAMPLE.finditer(text):
        # Empty lines before it, so that a traceback has the lines of the page.
        source = "\n" * text.count("\n", 0, example.start(1)) + example[1]
        command = [sys.executable, "-W", "error::DeprecationWarning:__main__", "-c", source]
        runs.append(
            subprocess.Popen(
                command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
            )
        )
    errors = [run.communicate()[1].decode() for run in runs]
    for run, error in zip(runs, errors):
        if run.returncode != 0:
            raise PluginError(f"docs/python.md: an example fails:\n{error}")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Append the API reference to the navigation."""
    packages = [{name: f"api/{name}.md"} for name in api_packages()]
    nav: List[Any] = config.nav or []
    config.nav = [*nav, {"API reference": ["api/index.md", *packages]}]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages and resolve the links of all pages."""
    site = RepositoryPages()
    for file in files.documentation_pages():
        site.add(f"docs/{file.src_uri}")
    for path in PAGES:
        site.add(path)
    pages = {**site.pages, **api_pages()}
    for uri, text in pages.items():
        old = files.get_file_from_path(uri)
        if old is not None:
            files.remove(old)
        files.append(File.generated(config, uri, content=text))
    return files


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Name the search for screen readers, and take nested lists of links off their landmarks."""
    named = output.replace('role="dialog">', 'role="dialog" aria-label="Search">')
    return NESTED_NAV.sub(r'\1 role="none">', named)


class RepositoryPages:
    """Pages of the site, by their path in it, that show files of the repository.

    Adding a page adds the pages that it links to.
    """

    def __init__(self) -> None:
        self.pages: Dict[str, str] = {}

    def add(self, path: str) -> str:
        """Add the page of a file or folder and return its path in the site."""
        uri = site_path(path)
        if uri not in self.pages:
            self.pages[uri] = ""  # ends the recursion where pages link to each other
            self.pages[uri] = self._text(path, uri)
        return uri

    def _text(self, path: str, uri: str) -> str:
        source = ROOT / path
        if source.is_dir():
            names = sorted(entry.name + "/" * entry.is_dir() for entry in source.iterdir())
            listing = "".join(
                f"* [{name}]({path}/{name})\n" for name in names if name[0] not in "._"
            )
            return self._linked(f"# {path}/\n\n{listing}", PurePosixPath(), uri)
        text = source.read_text(encoding="utf-8")
        if source.suffix == ".md":
            return self._linked(text, PurePosixPath(path).parent, uri)
        language = source.suffix[1:] or "text"
        return f"# {path}\n\n``````{language}\n{text}\n``````\n"

    def _linked(self, text: str, folder: PurePosixPath, uri: str) -> str:
        """Point the links of a page at pages of the site."""

        def target(match: re.Match[str]) -> str:
            path = os.path.normpath(folder / match[2])
            if path.startswith("..") or not (ROOT / path).exists():
                return match[0]  # mkdocs reports it
            shown = (ROOT / path).suffix in (".png", ".svg", ".gif")
            page = site_path(path) if shown else self.add(path)
            relative = os.path.relpath(page, PurePosixPath(uri).parent)
            return f"{match[1]}{relative}{match[3] or ''}{match[4]}"

        return LINK.sub(target, text)


def site_path(path: str) -> str:
    """Return the path in the site of a file or folder of the repository."""
    if path in PAGES:
        return PAGES[path]
    if path.startswith("docs/"):
        return path[len("docs/") :]
    if (ROOT / path).is_dir():
        return f"repository/{path}/index.md"
    return f"repository/{path}" if path.endswith(".md") else f"repository/{path}.md"


def api_packages() -> List[str]:
    """Return the names of the packages and modules directly in ``quad_nav``."""
    packages = {file.parent.name for file in PACKAGE.glob("*/__init__.py")}
    modules = {file.stem for file in PACKAGE.glob("*.py") if not file.stem.startswith("_")}
    return sorted(packages | modules)


def api_pages() -> Dict[str, str]:
    """Return the pages of the API reference, by their path in the site."""
    pages = {f"api/{name}.md": f"::: quad_nav.{name}\n" for name in api_packages()}
    links = "".join(f"* [quad_nav.{name}]({name}.md)\n" for name in api_packages())
    head = "::: quad_nav\n    options:\n      members: false\n      show_submodules: false\n"
    pages["api/index.md"] = f"{head}\n## Packages and modules\n\n{links}"
    return pages
