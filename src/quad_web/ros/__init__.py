"""Node `web`: show a flight of ROS nodes on pages, and let people steer it.

Reading order: `intake` subscribes to what pages show and keeps the newest messages, `poses`,
`layers` and `reports` make items from them, `source` puts these into the state of the pages.
`actions` carries out what people do, with `calls` to services and `parameters` of
dynamic_reconfigure. `node` starts all of them and the server.
"""
