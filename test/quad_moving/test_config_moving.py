"""Shipped configurations that are `config/moving` but for some parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from quad_nav.config.files import leaves

ROOT = Path(__file__).resolve().parents[2]


def parameters(name):
    files = (ROOT / "config" / name).glob("*.yaml")
    found = [leaf for file in files for leaf in leaves(file, {"i": "0"}).items()]
    assert len(found) == len(dict(found))
    return dict(found)


@pytest.mark.parametrize(
    "name, differences",
    [
        (
            "people",
            {
                "moving_obstacles/max_acceleration",
                "moving_obstacles/evasion_speed",
            },
        ),
    ],
)
def test_a_configuration_differs_from_config_moving_in_these_alone(name, differences):
    moving, other = parameters("moving"), parameters(name)
    assert {
        path for path in {*moving, *other} if moving.get(path) != other.get(path)
    } == differences
