"""The page in the browser: it shows a ``FleetState`` and calls ``Actions``.

``server`` serves the page, ``access`` decides who may watch and steer, ``stream`` sends the items
of the state to each client, ``page`` lays the page out. Maps, 3D and charts are drawn in the
browser by the modules in ``static``. Needs the extra ``web``.
"""
