"""Packages beside the core: which commands they have, and how to get one that is missing."""

from __future__ import annotations

import importlib
from typing import Any, Dict

import click

EXTRAS: Dict[str, str] = {
    "quad_bench": "bench",
    "quad_moving": "moving",
    "quad_rl": "rl",
    "quad_tune": "tune",
    "quad_vehicles": "vehicles",
    "quad_web": "web",
}
"""Package -> extra of pip that installs what it needs."""


def load(module: str, wanted: str) -> Any:
    """Import a module of an add-on.

    Args:
        module: Its dotted name.
        wanted: What needs it, as `quad tune` or `--web`, for the message.

    Raises:
        ClickException: The add-on is not installed; the message says how to install it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name not in EXTRAS:
            raise
        raise click.ClickException(
            f"{wanted}: the add-on {error.name} is not installed; "
            f"install it with: pip install 'quad-nav[{EXTRAS[error.name]}]'"
        ) from error
