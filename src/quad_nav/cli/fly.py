"""``quad fly``: fly a mission offline."""

from __future__ import annotations

import math
from typing import Any

import click

from quad_nav.cli.options import (
    A_FILE,
    A_FOLDER,
    A_PATH,
    AMOUNT,
    CONFIGURATIONS,
    COUNT,
    OUTPUT,
    POSITIVE,
    GroupedCommand,
    Integer,
    web_options,
)

# Those of quad_nav.sim.simulation and .flight; importing them would load the engine.
LIDAR_CASTERS = ("kernel", "bullet")
AIRFRAMES = ("default", "arducopter")
LOCALIZATIONS = ("simulator", "amcl", "slam")


@click.command(
    cls=GroupedCommand,
    headings={
        "scene": "Mission",
        "airframe": "Robots",
        "lidar": "Simulation",
        "json_path": "Output",
        "web": "Page in the browser",
    },
    epilog="\b\nExample:\n  quad fly --scene office.yaml --goals my_goals/ --report flight.html"
    "\n\nMore: docs/offline.md",
)
@click.option(
    "--scene",
    type=A_FILE,
    help="Scene file: walls, obstacles and start poses. [default: the shipped arena]",
)
@click.option(
    "--goals",
    type=A_PATH,
    help="Folder with quad0_goals.json and so on, or a file of goals or waypoints. [default: the"
    " shipped goals]",
)
@click.option(
    "--config",
    default="default",
    show_default=True,
    metavar="NAME|FOLDER",
    help=f"Configuration of move_base: {CONFIGURATIONS}.",
)
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="PATH=VALUE",
    help="Set a parameter on top of --config, as global_costmap/width=60; repeatable.",
)
@click.option(
    "--robots",
    type=COUNT,
    metavar="N",
    help="Number of quadcopters. More than two without --scene and --goals fly a random mission."
    " [default: one for each goal file]",
)
@click.option(
    "--size",
    "size_m",
    type=AMOUNT,
    default=0.0,
    metavar="M",
    help="Side of a random mission's arena. [default: large enough for all quadcopters]",
)
@click.option(
    "--seed",
    type=Integer(0, 2**63 - 1),  # scenario.rules.MAX_SEED, whose module loads numpy
    metavar="N",
    default=0,
    show_default=True,
    help="Seed of jitter, noise, drift and random missions; the same seed gives the same flight.",
)
@click.option(
    "--jitter",
    type=AMOUNT,
    default=0.0,
    metavar="M",
    help="Displace each start position at random, by at most this distance.",
)
@click.option(
    "--time-limit",
    "time_limit_s",
    type=POSITIVE,
    default=math.inf,
    metavar="S",
    help="End the flight after this simulated time.",
)
@click.option(
    "--airframe",
    type=click.Choice(AIRFRAMES),
    default="default",
    show_default=True,
    help="Bodies that follow commands at once, or as slowly as with ArduCopter.",
)
@click.option(
    "--odom-drift",
    default="",
    metavar="NAME=VALUE,...",
    help="Errors of the odometry, such as per_m=0.05,per_rad=0.05. [default: none]",
)
@click.option(
    "--localization",
    type=click.Choice(LOCALIZATIONS),
    default=LOCALIZATIONS[0],
    show_default=True,
    help="How robots know their places: exactly; by LIDAR and the scene's map (amcl); or by LIDAR"
    " alone (slam).",
)
@click.option(
    "--scan-range",
    type=POSITIVE,
    default=2 * math.pi,
    metavar="RAD",
    help="Field of view of the LIDARs. [default: 2 pi]",
)
@click.option(
    "--beams", type=Integer(min=2), default=512, show_default=True, help="Beams per scan."
)
@click.option(
    "--lidar-rate",
    "scans_per_s",
    type=POSITIVE,
    default=20.0,
    show_default=True,
    metavar="HZ",
    help="Scan rate, in simulated time.",
)
@click.option(
    "--range-noise",
    type=AMOUNT,
    default=0.0,
    metavar="M",
    help="Standard deviation of the LIDARs' range noise.",
)
@click.option(
    "--lidar",
    type=click.Choice(LIDAR_CASTERS),
    default="kernel",
    show_default=True,
    help="Cast the beams with the numba kernel or with the physics engine.",
)
@click.option(
    "--processes",
    type=COUNT,
    metavar="N",
    help="Processes that share the navigators; the flight does not depend on it. [default: one"
    " for each core, at most one per quadcopter]",
)
@click.option(
    "--json",
    "json_path",
    type=OUTPUT,
    metavar="FILE",
    help="Write the summary as JSON; - is standard output.",
)
@click.option(
    "--report",
    type=A_FILE,
    metavar="FILE.html",
    help="Write a report with plots of the flight.",
)
@click.option(
    "--pictures",
    type=A_FOLDER,
    metavar="FOLDER",
    help="Write the report's pictures to this folder, each as a PNG and an SVG file.",
)
@click.option(
    "--animate",
    type=A_FILE,
    metavar="FILE",
    help="Write an animation: .gif, or .mp4 if ffmpeg is installed.",
)
@click.option(
    "--record",
    type=A_FILE,
    metavar="FILE.bag",
    help="Record the ROS topics, for rosbag play and RViz.",
)
@click.option("--quiet", "-q", is_flag=True, help="Show no progress bar and no table.")
@click.option(
    "--web",
    is_flag=True,
    help="Show the flight on a page in the browser, where people can also steer it. It begins when"
    " a page is open; Ctrl-C closes the page.",
)
@web_options
@click.option(
    "--rate",
    type=AMOUNT,
    default=1.0,
    show_default=True,
    metavar="R",
    help="Simulated seconds per second with --web, until somebody sets another one on the page; 0"
    " is as fast as it goes.",
)
def fly(**given: Any) -> None:
    """Fly a mission without ROS, as fast as the machine allows.

    Ctrl-C ends the flight; summary, recording and report cover the part that was flown.

    Exit status: 0 if every goal was reached without a contact, 1 otherwise, 2 for faulty input,
    130 after Ctrl-C.
    """
    # Imported here: the engine loads slowly, and --help does not need it.
    from quad_nav.cli.offline_flight import fly_mission

    fly_mission(**given)
