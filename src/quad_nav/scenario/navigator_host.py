"""One robot's navigator with all that belongs to it, whoever brings its data.

Every shell hosts navigators by ``NavigatorHost``: nodes with topics, the loop of a simulation and
its worker processes, the Python API, tests. A shell moves data only. It hands messages of sensors
to the intakes and goals to the navigator, ticks with a snapshot of poses, velocity and peers, and
passes the result on.
"""

from __future__ import annotations

import time
from typing import List, Optional, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.scan_intake import ScanIntake, Sink
from quad_nav.costmap.scan_validator import ScanValidator
from quad_nav.geometry import Twist2D
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.peers.peer import Peer
from quad_nav.scenario.assembly import (
    apply_configuration,
    build_navigator,
    build_scan_filters,
    set_footprint,
)


class NavigatorHost:
    """A navigator, the filters of its scans, and the intakes of its sensors.

    Attributes:
        configuration: The parameters in force.
        navigator: The navigator.
        costmaps: Its global costmap and its local one.
        scan_filters: Filters of its scans.
        intakes: Intakes of the robot's sensors, see ``new_intake``.
        wall_s: Wall time of the last tick.
        cycle_wall_s: Wall time of the last tick with a control cycle, None before the first.
        plan: The last global plan, float64[n, 3] in its costmap's frame, None before the first.
        local_plan: The last local plan, the same.
        limited_by: Name of the peer that limited the last command, "" if none did.
        stopped_reason: Why the robot stops for lack of data, "" if it does not.
    """

    def __init__(self, configuration: Configuration, number: Optional[int] = None) -> None:
        """Build an idle navigator; ``number`` is the robot's, by default the configuration's."""
        self.configuration = configuration
        self.navigator = build_navigator(configuration, number)
        self.costmaps = self.navigator.global_costmap, self.navigator.local_costmap
        self.scan_filters = build_scan_filters(configuration)
        self.intakes: List[ScanIntake] = []
        self.wall_s = 0.0
        self.cycle_wall_s: Optional[float] = None
        self.plan: Optional[NDArray[np.float64]] = None
        self.local_plan: Optional[NDArray[np.float64]] = None
        self.limited_by = self.stopped_reason = ""

    def new_intake(self, sinks: Sequence[Sink]) -> ScanIntake:
        """Return the intake of one sensor for these layers and sources."""
        intake = ScanIntake(sinks, self.scan_filters, self.costmaps[1].params.global_frame)
        self.intakes.append(intake)
        return intake

    def reconfigure(self, configuration: Configuration) -> None:
        """Change every parameter that may change in flight; plan and goal stay."""
        apply_configuration(self.navigator, configuration)
        for scan_filter in self.scan_filters.filters:
            if isinstance(scan_filter, ScanValidator):
                scan_filter.params = configuration.scan_validator
        for intake in self.intakes:
            intake.reconfigure()
        self.configuration = configuration

    def set_footprint(self, costmap: LayeredCostmap, footprint: NDArray[np.float64]) -> None:
        """Give one of the costmaps, and its planner, another unpadded footprint, float64[n, 2]."""
        set_footprint(self.navigator, self.configuration, costmap, footprint)

    def restart(self, now_s: float) -> None:
        """Restart schedules, costmaps and filters after the clock has jumped back."""
        for intake in self.intakes:
            intake.reset()
        self.navigator.restart(now_s)

    def tick(
        self, now_s: float, poses: RobotPoses, velocity: Twist2D, peers: Sequence[Peer]
    ) -> Tick:
        """Tick the navigator with a snapshot; see ``Navigator.tick``."""
        start_s = time.perf_counter()
        tracks = self.scan_filters.tracks(now_s)
        tick = self.navigator.tick(now_s, poses, velocity, peers, tracks)
        self.wall_s = time.perf_counter() - start_s
        if tick.plan is not None or tick.planning_failed:
            self.plan = tick.plan
        if tick.cycle:
            self.cycle_wall_s = self.wall_s
            self.local_plan = None if tick.control is None else tick.control.local_plan
            self.stopped_reason = tick.warnings[0] if tick.is_stopped else ""
        if tick.command is not None:
            self.limited_by = tick.limited_by
        return tick
