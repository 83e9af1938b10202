"""Several quadcopters on the ROS navigation stack.

Everything is one circle: scan -> costmap -> global plan -> velocity -> body ->
scan. It is written here in plain Python with time as an argument; ``offline/``
runs it in one process, and ``ros/`` cuts it at the topics.

Reading order: ``geometry`` and ``grid`` (the nouns), ``costmap`` (scan to
costs), ``plan`` (costs to path), ``control`` (path to velocity), ``recovery``
and ``navigator`` (when to do which), ``peers`` and ``traffic`` (who gives way),
``mission`` (which goal next), ``sim`` (velocity to body to scan), ``config``
(move_base's YAML to parameters), ``offline/flight`` (the circle), ``face`` (what
the topics say), ``ros`` (topics, services, actions), ``cli`` (the command line).
"""

__version__ = "0.1.0"
