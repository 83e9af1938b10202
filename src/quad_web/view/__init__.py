"""What a page in the browser shows of a fleet, and what a person can do to it.

Reading order: ``state`` has the items that a page shows, ``items``, ``rows`` and ``cells`` make
them, ``codec`` turns them into bytes, and ``actions`` has what a person can do. A
source (running nodes, an offline flight, a recording) writes into a ``FleetState`` and implements
``Actions``. ``quad_web`` shows the one and calls the other.
"""
