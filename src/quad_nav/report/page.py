"""Pages: single HTML files with their plots and pictures inside, which load nothing."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Callable, Optional, Sequence, Tuple, Union

import jinja2
from matplotlib.figure import Figure

from quad_nav.files.output import write_bytes, write_text
from quad_nav.report import style
from quad_nav.report.plot import Plot, Scripts, plot_scripts

MAX_STRIPS = 6
"""Number of close encounters that a report shows."""


@dataclass(frozen=True)
class Picture:
    """Picture for paper, with its file name; ``alt`` describes its content.

    It is drawn when it is needed. ``draw`` returns a new figure each time.
    """

    name: str
    alt: str
    draw: Callable[[], Figure]

    @cached_property
    def png(self) -> bytes:
        """The picture as a PNG file."""
        with style.styled():
            return style.png(self.draw())

    @property
    def svg(self) -> bytes:
        """The picture as an SVG file."""
        with style.styled():
            return style.svg(self.draw())

    @property
    def source(self) -> str:
        """The picture as a data URL."""
        return "data:image/png;base64," + base64.b64encode(self.png).decode("ascii")


@dataclass(frozen=True)
class Section:
    """Section of a page.

    Attributes:
        anchor: Name for links.
        heading: Heading.
        caption: Text below the heading.
        pictures: Pictures that the page shows.
        notes: Headings of the pictures.
        plots: Plots that the page shows, above the pictures.
        paper: Pictures that the page does not show, as it has a plot of the same.
    """

    anchor: str
    heading: str
    caption: str
    pictures: Tuple[Picture, ...] = ()
    notes: Tuple[str, ...] = ()
    plots: Tuple[Plot, ...] = ()
    paper: Tuple[Picture, ...] = ()


@dataclass(frozen=True)
class Page:
    """HTML of a page, and its pictures for paper."""

    html: str
    pictures: Tuple[Picture, ...]


def picture(name: str, alt: str, figure: Union[Figure, Callable[[], Figure]]) -> Picture:
    """Make a picture from a figure, or from a function that draws it."""
    return Picture(name, alt, figure if callable(figure) else lambda: figure)


def render(
    template: str, sections: Sequence[Section], folder: Optional[Path] = None, **context: Any
) -> Page:
    """Render a page from a template; ``folder`` is a further one with templates."""
    has_plots = any(section.plots for section in sections)
    scripts = plot_scripts() if has_plots else Scripts()
    html = html_of(template, folder, sections=sections, scripts=scripts, **context)
    pictures = (one for section in sections for one in (*section.paper, *section.pictures))
    return Page(html, tuple(pictures))


def html_of(template: str, folder: Optional[Path] = None, **context: Any) -> str:
    """Render a template of this folder, or of a further one."""
    folders = [Path(__file__).parent, *([folder] if folder is not None else [])]
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folders),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["figure"] = _number
    return environment.get_template(template).render(**context)


def _number(value: Optional[float], decimals: int = 2) -> str:
    return "–" if value is None else f"{round(value, decimals) + 0.0:.{decimals}f}"


def write_page(page: Page, path: Path) -> None:
    """Write the HTML atomically.

    Raises:
        OSError: A file cannot be written.
    """
    write_text(path, page.html)


def write_pictures(page: Page, folder: Path) -> None:
    """Write the pictures of a page as PNG and SVG files; folders are created.

    Raises:
        OSError: A file cannot be written.
    """
    for one in page.pictures:
        write_bytes(folder / f"{one.name}.png", one.png)
        write_bytes(folder / f"{one.name}.svg", one.svg)
