"""Swap of sides: robots on a circle fly to the opposite side, all at once.

Reading order: ``setup`` (starts, goals, configuration), ``orca`` (the baseline's velocities),
``runs`` (flights by each method, and what is measured of them), ``results`` (text, JSON and CSV).
"""
