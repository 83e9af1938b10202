"""Measure how many steps per second an environment for reinforcement learning makes."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Dict, List, Optional, Tuple

import click
import numpy as np
import tabulate
from figures import JSON_HELP, LARGER, Figures

import quad_nav
from quad_rl import FleetEnv
from quad_rl.fleet import Action

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


def resets_ms(env: FleetEnv) -> List[float]:
    """Return the CPU time of each of 20 resets."""
    times = []
    for _ in range(20):
        start_ns = time.process_time_ns()
        env.reset()
        times.append(1e-6 * (time.process_time_ns() - start_ns))
    return times


def policies() -> Dict[str, List[Action]]:
    """Return circles away from everything, and random velocities that end at walls."""
    walk = np.random.default_rng(0).uniform(-1.0, 1.0, (512, 3)).astype(np.float32)
    return {"circles": [np.array([0.3, 0.1, 0.9], np.float32)], "random": list(walk)}


@click.command()
@click.option("--json", "file", type=click.Path(path_type=Path), help=JSON_HELP)
def main(file: Optional[Path]) -> None:
    """Print steps per second with 64 beams at 10 Hz control, on one core.

    The best of five rounds is shown, because other programs only make a round slower. The file has
    all rounds.
    """
    figures, rows = Figures("rl"), []
    for robots, navigator in ((1, False), (2, False), (1, True)):
        env = environment(robots, navigator)
        steps = 50 if navigator else STEPS
        for name, actions in policies().items():
            if name != "circles" and (navigator or robots > 1):
                continue
            rates(env, actions, steps)  # compiled kernels are loaded, caches warm
            rounds = [rates(env, actions, steps) for _ in range(ROUNDS)]
            wall, cpu = (max(one) for one in zip(*rounds))
            case = f"{robots} robots, navigator {'on' if navigator else 'off'}, {name}"
            figures.add(f"steps per CPU second, {case}", "1/s", [one[1] for one in rounds], LARGER)
            reset_ms = figures.add(f"reset, {case}", "ms", resets_ms(env))
            required = f"{REQUIRED:.0f}" if robots == 1 and not navigator else ""
            row = [
                robots,
                "on" if navigator else "off",
                name,
                f"{wall:.0f}",
                f"{cpu:.0f}",
                required,
            ]
            rows.append([*row, f"{reset_ms:.2f}"])
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
    print(f"Environments of quad_rl: {BEAMS} beams, {1 / PERIOD_S:.0f} Hz control, one core")
    print(tabulate.tabulate(rows, header, disable_numparse=True, stralign="right"))
    figures.write(file)


if __name__ == "__main__":
    main()
