"""Finds parameters that fly better, offline: many flights for each of many candidates.

Read ``space`` (what is searched), ``courses`` (what is flown: missions, or BARN's worlds in
``barn_course``), ``flight_result`` (what a flight comes to), ``score`` (how good that is),
``figures`` (what many come to), ``workers`` (flights at the same time, here or on a Ray
cluster), ``journal`` (flights that are kept), ``evaluation`` (candidates times flights),
``proposals`` and ``study`` (candidates, and what was told of them), ``search`` (the whole
search), ``refinement`` (the best one, and what each of its parameters gains),
``parameter_files`` and ``yaml_edit`` (it as files), ``tune`` (all of it), ``record``
(its figures in words and JSON), ``sweep`` with ``sweep_table`` (a table instead of a search)
and ``report`` (pages).

Nothing else of quad imports this package, so that nothing else waits for optuna.
"""
