"""Upstream behaviour: a tree that switches every deviation off."""

from __future__ import annotations

UPSTREAM = {"fixes": {"upstream": True}}
