"""Fly the tutorial's mission with bodies that respond as slowly as with a real autopilot.

    PYTHONPATH=src python3 bench/airframe.py --airframe arducopter --seeds 20

Two quadcopters fly the shipped goals with the configurations ``default`` and ``tutorial``, each
seed with other starts and noise. Prints a line for each flight that misses a goal or has a contact,
and a line for each configuration.

Exit status: 0 if all flights reach all goals without a contact.
"""

from __future__ import annotations

import statistics
import sys
from dataclasses import replace
from typing import Tuple

import click

import quad_nav.api as quad
from quad_nav.sim.flight import AIRFRAMES

CONFIGS = ("default", "tutorial")
TIME_LIMIT_S = 600.0


@click.command()
@click.option("--airframe", type=click.Choice(tuple(AIRFRAMES)), default="arducopter")
@click.option("--seeds", type=click.IntRange(min=1), default=20, show_default=True)
@click.option("--jitter", "jitter_m", default=0.3, show_default=True)
@click.option("--config", "configs", multiple=True, default=CONFIGS, show_default=True)
@click.option("--set", "parameters", multiple=True, metavar="PATH=NUMBER")
def main(
    airframe: str,
    seeds: int,
    jitter_m: float,
    configs: Tuple[str, ...],
    parameters: Tuple[str, ...],
) -> None:
    """Fly the tutorial's mission with an airframe."""
    simulation = replace(quad.lidar_simulation(jitter_m=jitter_m), airframe=AIRFRAMES[airframe])
    given = {path: float(value) for path, value in (one.split("=") for one in parameters)}
    failed = 0
    for config in configs:
        times, good = [], 0
        for seed in range(1, seeds + 1):
            setup = quad.prepare(
                config=config,
                seed=seed,
                simulation=simulation,
                time_limit_s=TIME_LIMIT_S,
                parameters=given,
            )
            summary = quad.fly(setup, processes=1).summary
            legs = [leg for robot in summary.robots for leg in robot.legs]
            missed, contacts = sum(not leg.reached for leg in legs), len(summary.contacts)
            times.append(max(sum(leg.time_s for leg in robot.legs) for robot in summary.robots))
            good += not missed and not contacts
            if missed or contacts:
                click.echo(f"{config} seed {seed}: {missed} goals missed, {contacts} contacts")
        failed += seeds - good
        click.echo(
            f"{airframe} {config}: {good} of {seeds} flights reach all goals without a contact, "
            f"median {statistics.median(times):.1f} s"
        )
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
