"""A node warms up the kernels of the filters before it flies."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

import quad_moving
from quad_nav import config
from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.scenario.warm_up import warm_up

PUBLIC = {
    "compare_scan",
    "find_clusters",
    "find_arrived",
    "outline_clusters",
    "fit_disc",
    "predict_states",
    "update_state",
    "overlaps",
}


@pytest.mark.parametrize("name", ["moving", "people"])
def test_every_kernel_that_python_calls_is_compiled(name):
    warm_up(config.load(robot_tree(RobotSource(name, 0))))
    folder = Path(quad_moving.__file__).parent
    kernels = {
        kernel: value
        for path in folder.glob("*.py")
        for kernel, value in vars(importlib.import_module(f"quad_moving.{path.stem}")).items()
        if isinstance(value, Dispatcher) and kernel in PUBLIC
    }
    assert set(kernels) == PUBLIC
    assert {kernel for kernel, value in kernels.items() if not value.signatures} == set()
