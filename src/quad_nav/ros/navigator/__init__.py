"""The nodes `move_base` (one robot) and `fleet` (many robots in one process).

Reading order: `nodes` (start), `loop` (control loop), `robot_navigator` (one robot), then its
inputs `sensors`, `static_maps`, `peer_topics`, `intention_topics`, and `robot_interface` with
`goal_server`, `plan_services`, `reconfigure`, `plan_topics`, `costmap_publisher`, `health_meters`.
"""
