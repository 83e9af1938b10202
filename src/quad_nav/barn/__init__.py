"""The BARN benchmark, offline: narrow worlds that one quadcopter flies through.

``worlds`` reads them, ``setup`` checks what flies, ``runs`` flies, ``figures`` counts and
``results`` says it. The protocol itself is in ``protocol``.
"""
