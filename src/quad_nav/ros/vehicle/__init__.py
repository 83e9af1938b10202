"""Nodes of real vehicles: one bridge for each, and the node that replaces the simulator.

Reading order: `node`, `topics`, `mission_pause`, `fleet`, `scene_topics`.
"""
