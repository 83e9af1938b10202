"""Packages beside the core: how a command that lacks one, or what it needs, is refused."""

from __future__ import annotations

import importlib
from typing import Any, Dict

import click

EXTRAS: Dict[str, str] = {
    "quad_nav": "",
    "quad_bench": "",
    "quad_tune": "[tune]",
    "quad_web": "[web]",
}
"""Package with commands -> extra of pip that installs what it needs, "" for none."""


def load(module: str, wanted: str) -> Any:
    """Import a module of an add-on; ``wanted`` is what needs it, as `quad tune` or `--web`.

    Raises:
        ClickException: The add-on, or a library that it needs, is not installed; the message says
            how to install it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing == "quad_nav":  # a fault of the installation, or of ours
            raise
        package = missing if missing in EXTRAS else module.partition(".")[0]
        raise click.ClickException(
            f"{wanted}: {missing} is not installed; expected it from "
            f"pip install 'quad-nav{EXTRAS[package]}', or in a checkout from make venv"
        ) from error
