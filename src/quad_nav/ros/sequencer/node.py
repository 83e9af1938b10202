"""Node `sequencer`: send N quadcopters their goals and summarize their flight.

It checks all parameters, waits for the simulator and the navigators, starts the simulation, flies
the mission and writes the summary. Timers use simulated time and stop with a paused simulation.
"""

from __future__ import annotations

import os
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Callable, List, Optional

import rospy

from quad_nav.errors import InputError, printable
from quad_nav.mission.flight_log import INTERRUPTED, unflown_legs
from quad_nav.mission.respawn import RESPAWNED
from quad_nav.mission.summary import (
    EXIT_BAD_INPUT,
    EXIT_FAILURE,
    MissionSummary,
    RobotSummary,
    write_json,
)
from quad_nav.mission.summary_table import DEFAULT_WIDTH, table
from quad_nav.ros.common import readiness
from quad_nav.ros.common.preflight import read_mission_setup, result_path
from quad_nav.ros.common.readiness import init_node, server_parameters
from quad_nav.ros.sequencer.mission import MissionRunner
from quad_nav.scenario.mission_setup import START_SERVICE, MissionSetup

STOPPED = "stopped before all goals were reached"
Stop = Callable[[], str]
"""Returns why the node shuts down, "" if nothing is known."""
VIEWERS_S = 60.0  # wall time; longest wait for RViz or the page: without a window none comes up
DIAGNOSTICS_PERIOD_S = 1.0  # wall time, to show the state of a paused simulation


def watch(mission: MissionRunner, exit_when_done: bool, result: Path, stop: Stop) -> int:
    """Run the mission to its end, and report whenever all goals have been flown.

    Returns:
        The exit status.
    """
    status: Optional[int] = None
    next_s = 0.0
    mission.publish_summary(None)
    while not rospy.is_shutdown():
        mission.advance()
        if time.monotonic() >= next_s:
            next_s = time.monotonic() + DIAGNOSTICS_PERIOD_S
            mission.publish_progress()
        if not mission.is_done:
            if status is not None:
                mission.publish_summary(None)
            status = None
        elif status is None:
            summary = mission.summary()
            status = report(summary, result)
            mission.publish_summary(summary)
            if exit_when_done:
                mission.end()
                return status
    if status is None:
        status = report(mission.summary(stop() or STOPPED), result)
    return status


def report(summary: MissionSummary, result: Path) -> int:
    """Print the summary table, write the JSON file and return the exit status."""
    width = shutil.get_terminal_size((DEFAULT_WIDTH, 24)).columns
    print(printable(f"\n{table(summary, width)}", "\n"), flush=True)
    if not _write(summary, result):
        return summary.exit_status or EXIT_FAILURE
    print(printable(f"Summary written to {result}") + "\n", flush=True)
    return summary.exit_status


def _write(summary: MissionSummary, result: Path) -> bool:
    try:
        write_json(summary, result)
    except OSError as error:
        rospy.logerr("sequencer: cannot write the summary to %s: %s", result, error.strerror)
        return False
    return True


def fly(mission: MissionRunner, setup: MissionSetup, result: Path, stop: Stop) -> int:
    """Wait for the nodes, fly the mission, summarize it and return the exit status."""
    missing = readiness.wait_for(mission.needs(), setup.ready_timeout_s)
    if missing:
        reason = STOPPED if rospy.is_shutdown() else "not ready"
        return _not_flown(setup, result, stop() if stop() == INTERRUPTED else reason, missing)
    late = readiness.wait_for(mission.viewers(), VIEWERS_S)
    if late and not rospy.is_shutdown():
        rospy.logwarn("sequencer: the flight starts all the same:\n  %s", "\n  ".join(late))
    try:
        mission.start()
    except (rospy.ServiceException, rospy.ROSException) as error:
        what = "the simulation" if setup.simulation else "the vehicles"
        problem = f"{setup.start_service}: {error}"
        return _not_flown(setup, result, f"{what} did not start", [problem])
    try:
        return watch(mission, setup.exit_when_done, result, stop)
    except Exception as error:  # keep the result of the flight after a bug
        report(mission.summary(f"internal error: {error!r}"), result)
        raise
    finally:
        rospy.signal_shutdown("the sequencer is done")


def _not_flown(setup: MissionSetup, result: Path, reason: str, lines: List[str]) -> int:
    problems = "\n  ".join(map(printable, lines))
    if rospy.is_shutdown():  # what is missing may have been on its way
        print(printable("sequencer: stopped before the flight started"), flush=True)
    else:
        rospy.logfatal(f"sequencer: flight not started, {printable(reason)}:\n  {problems}")
    robots = tuple(
        RobotSummary(robot.name, tuple(unflown_legs(robot.sequence))) for robot in setup.robots
    )
    summary = MissionSummary(
        robots,
        robot_radius_m=setup.robot_radius_m,
        reason=reason if reason == INTERRUPTED else f"{reason}: {'; '.join(lines)}",
        contacts_reported=False,
        facts=setup.facts,
    )
    _write(summary, result)
    return summary.exit_status


class _Signalled:
    """Reason of a shutdown by a signal: Ctrl-C, or roslaunch, which ends all nodes if one dies."""

    def __init__(self) -> None:
        self.simulation = True
        self._reason = ""

    def __call__(self) -> str:
        return self._reason

    def receive(self) -> None:
        """Find out the reason while the ROS master lives."""
        lost = readiness.lost_service(START_SERVICE, "simulator") if self.simulation else ""
        self._reason = lost or INTERRUPTED


def launch_command() -> List[str]:
    """Return the command line of the roslaunch that started this node, or else the node's own."""
    pid = os.getppid()
    while pid > 1:
        try:
            argv = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace").split("\0")
            stat = Path(f"/proc/{pid}/stat").read_text()
        except OSError:  # an ancestor has ended meanwhile
            break
        for place, argument in enumerate(argv):
            name = Path(argument).name.replace("quiet_", "")  # that of scripts/fly
            if name in ("roslaunch", "rostest"):
                return [name, *argv[place + 1 : -1]]
        pid = int(stat.rpartition(")")[2].split()[1])  # behind the name: state, parent
    return list(sys.argv)


def main() -> int:
    """Run the node.

    Returns:
        Exit status: 0 if all goals were reached without a contact, 1 otherwise, 2 for parameters
        or files that are not valid, 130 after Ctrl-C.
    """
    stop = _Signalled()
    init_node("sequencer", stop.receive)
    name = rospy.get_name()
    parameters = rospy.get_param("~", {})
    result = result_path(parameters)
    try:
        setup = read_mission_setup(parameters, name, result, server_parameters())
        setup = replace(setup, facts={**setup.facts, "command": launch_command()})
        mission = MissionRunner(setup, RESPAWNED in sys.argv)
    except InputError as error:
        rospy.logfatal(
            "sequencer: flight not started, invalid input:" + "\n  %s" * len(error.problems),
            *error.problems,
        )
        _write(
            MissionSummary(
                (),
                reason="bad input",
                problems=tuple(error.problems),
                facts={"command": launch_command()},
            ),
            result,
        )
        return EXIT_BAD_INPUT
    stop.simulation = setup.simulation
    for note in setup.notes:
        rospy.loginfo("%s", note)
    for warning in setup.warnings:
        rospy.logwarn("%s", warning)
    return fly(mission, setup, result, stop)
