"""Settings of the state machines, and what all of their worlds have in common."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

EXAMPLES = int(os.environ.get("QUAD_EXAMPLES", "0"))
"""Number of examples of all machines together; 0 for a few, the same ones each time."""


def machine_settings(few, share):
    """Return the settings of a machine.

    Args:
        few: Number of examples in a run of all tests.
        share: Part of `QUAD_EXAMPLES`.
    """
    return settings(
        max_examples=round(EXAMPLES * share) or few,
        stateful_step_count=20,
        derandomize=not EXAMPLES,
        deadline=None,
        database=None,
        print_blob=True,
        suppress_health_check=list(HealthCheck),
    )


def assert_sound(graph):
    """Assert that no node and no callback has ended with an exception."""
    crashes = [f"{node.name} has crashed:\n{text}" for node, text in graph.threads.crashes]
    assert not crashes + graph.failures, "\n".join(crashes + graph.failures)
