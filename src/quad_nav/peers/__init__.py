"""Avoidance between robots: priority, yielding, holding points, Voronoi cells.

Robots share their poses and intentions. Three layers act on conflicts, each only on those that
the previous one left: costs around peers let plans pass them by, a robot of lower priority
yields, and every command stays inside the robot's own Voronoi cell. ``docs/peers.md``
describes the layers.

Reading order: ``peer`` (what a robot knows of another), ``peer_tracker`` (which peers matter),
``peer_costs`` (peers in the costmaps), ``right_of_way`` (who yields), ``holding_point`` (where to
yield to), ``yielding`` (yield, and for how long), ``voronoi_cell`` (safe commands), and
``coordinator``, which the navigator asks: observe, decide, cell.
"""
