"""Measure how many steps per second an environment for reinforcement learning makes."""

from __future__ import annotations

import sys
import time
from typing import Dict, List, Tuple

import click
import numpy as np
import tabulate

import quad_nav
from quad_nav.rl import FleetEnv
from quad_nav.rl.fleet import Action

BEAMS = 64
PERIOD_S = 0.1
REQUIRED = 5000.0  # steps of one robot per second, without a navigator
GOALS = [[[10.0, 10.0]], [[2.0, 10.0]]]  # far, so that few episodes end
ROUNDS, STEPS = 5, 500


def environment(robots: int, navigator: bool) -> FleetEnv:
    """Return the shipped arena with LIDARs of 64 beams at 10 Hz control."""
    simulation = quad_nav.lidar_simulation(BEAMS, jitter_m=0.3)
    setup = quad_nav.prepare(goals=GOALS[:robots], simulation=simulation)
    return FleetEnv(setup, navigator=navigator, period_s=PERIOD_S)


def rates(env: FleetEnv, actions: List[Action], steps: int) -> Tuple[float, float]:
    """Return steps per second of wall time and of CPU time, with the resets among them.

    Args:
        env: The environment.
        actions: What each robot flies, over and over.
        steps: Number of steps.
    """
    env.reset(seed=1)
    start_s, start_cpu_s = time.perf_counter(), time.process_time()
    for step in range(steps):
        if not env.agents:
            env.reset()
        env.step(dict.fromkeys(env.agents, actions[step % len(actions)]))
    cpu_s = time.process_time() - start_cpu_s
    return steps / (time.perf_counter() - start_s), steps / cpu_s


def reset_s(env: FleetEnv) -> float:
    """Return the CPU time of a reset."""
    start_s = time.process_time()
    for _ in range(20):
        env.reset()
    return (time.process_time() - start_s) / 20


def policies() -> Dict[str, List[Action]]:
    """Return circles away from everything, and random velocities that end at walls."""
    walk = np.random.default_rng(0).uniform(-1.0, 1.0, (512, 3)).astype(np.float32)
    return {"circles": [np.array([0.3, 0.1, 0.9], np.float32)], "random": list(walk)}


@click.command()
def main() -> None:
    """Print steps per second with 64 beams at 10 Hz control, on one core.

    The best of five rounds counts, because other programs only make a round slower.
    """
    rows = []
    for robots, navigator in ((1, False), (2, False), (1, True)):
        env = environment(robots, navigator)
        steps = 50 if navigator else STEPS
        for name, actions in policies().items():
            if name != "circles" and (navigator or robots > 1):
                continue
            rates(env, actions, steps)  # compiled kernels are loaded, caches warm
            rounds = [rates(env, actions, steps) for _ in range(ROUNDS)]
            wall, cpu = (max(one) for one in zip(*rounds))
            required = f"{REQUIRED:.0f}" if robots == 1 and not navigator else ""
            row = [
                robots,
                "on" if navigator else "off",
                name,
                f"{wall:.0f}",
                f"{cpu:.0f}",
                required,
            ]
            rows.append([*row, f"{1000 * reset_s(env):.2f}"])
        env.close()
        print(f"{robots} flown", file=sys.stderr)
    header = [
        "robots",
        "navigator",
        "actions",
        "steps/s",
        "per CPU\nsecond",
        "required",
        "reset\nms",
    ]
    print(f"Environments of quad_nav.rl: {BEAMS} beams, {1 / PERIOD_S:.0f} Hz control, one core")
    print(tabulate.tabulate(rows, header, disable_numparse=True, stralign="right"))


if __name__ == "__main__":
    main()
