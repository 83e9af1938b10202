"""Nodes of real vehicles: one bridge for each, and the node that replaces the simulator.

Reading order: `node`, `topics`, `fleet`, `scene_topics`.
"""
