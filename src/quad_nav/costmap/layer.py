"""What a costmap layer is."""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LayerParams:
    """Parameters that every layer has."""

    enabled: bool = True
