"""Reports of flights: from a ``FlightTrace`` to HTML, PNG, GIF and MP4.

Reading order: ``measures`` and ``flight_metrics`` (what is computed from a trace),
``encounters`` (close encounters and contacts), ``paths``, ``distances`` and ``timeline`` (what the
figures show), ``plotly_figures`` (draws them in pages) and ``matplotlib_figures`` (on paper), the
modules that end in ``_picture`` (drawn with matplotlib alone), ``page`` (the HTML around them),
``animation``.

Only this package and reports of add-ons import matplotlib and jinja2. Commands that fly import
them only if a report is requested, because that takes longer than starting a flight.
"""

from __future__ import annotations

import importlib
import warnings

# ROS desktops have an older matplotlib among the system's packages, whose module for 3D plots
# shadows ours. The reports have no 3D plots, so the warning about it is suppressed.
with warnings.catch_warnings():
    warnings.filterwarnings("ignore", "Unable to import Axes3D")
    importlib.import_module("matplotlib.projections")
