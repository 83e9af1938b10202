"""Content of the topics, without ROS: used by the nodes and by the offline recorder.

Each shell converts these plain objects into its own message classes. Those of our own messages have
`fields`, which both shells give to the class of the message.

Reading order: `flight_info`, `mission_events`, `contacts` and `right_of_way` (our own messages),
`markers` (scene, quadcopters and goals), `publishing` (what to publish of costmaps and paths, and
when), `health` (diagnostics), `validation` (accept or reject incoming messages), `rviz_file` (the
RViz configuration), `goal_routing` (who gets a goal of the fleet), `vehicle_states` (what a real
vehicle does).
"""
