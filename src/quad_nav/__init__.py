"""Several quadcopters on the ROS navigation stack.

Everything is one circle: scan -> costmap -> global plan -> velocity -> body ->
scan. It is written here in plain Python with time as an argument; ``ros/``
cuts it at the topics.

Reading order: ``geometry`` and ``grid`` (the nouns), ``costmap`` (scan to
costs), ``plan`` (costs to path), ``control`` (path to velocity), ``recovery``
and ``navigator`` (when to do which), ``mission`` (which goal next), ``sim``
(velocity to body to scan), ``config`` (move_base's YAML to parameters), ``ros``
(topics, services, actions).
"""

__version__ = "0.1.0"
