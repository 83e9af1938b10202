"""BARN benchmark, offline: one quadcopter flies through narrow worlds.

Reading order: ``protocol`` (start, goal, outcomes, score), ``worlds`` (the worlds as scenes),
``setup`` (checked parameters), ``runs`` (flights), ``statistics`` (counts and means),
``results`` (text, JSON and CSV). DynaBARN, with obstacles that move: ``dynamic_worlds``,
``dynamic`` (protocol, set-up and flights), ``dynamic_results``.
"""
