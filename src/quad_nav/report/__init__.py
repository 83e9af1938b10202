"""Pictures and pages of flights: from a ``FlightTrace`` to HTML, PNG, GIF and MP4.

Read ``measures`` (what is computed from a trace), ``encounters`` (who came close to
whom), the modules that end in ``_picture`` (one picture each, on matplotlib's figures),
``page`` (the HTML that holds them), ``animation``, and ``write`` (files).

Nothing outside this package imports matplotlib or jinja2, and commands import this
package only when a report is asked for: that takes longer than to start a flight.
"""

from __future__ import annotations

import warnings

# ROS desktops have an older matplotlib among the system's packages, which takes the place of ours
# for pictures in 3D. There are none here, and people should not read a warning about them.
with warnings.catch_warnings():
    warnings.filterwarnings("ignore", "Unable to import Axes3D")
    import matplotlib.projections  # noqa: F401
