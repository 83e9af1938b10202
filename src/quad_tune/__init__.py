"""Offline tuning: find better parameters by many flights of many candidates.

Reading order:

- ``space`` (searched parameters), ``courses`` and ``barn_course`` (flown missions or worlds),
  ``study_input`` (checks of both);
- ``flight_result`` (result of a flight), ``score`` (its cost), ``statistics`` (of many flights),
  ``study_database`` and ``flight_cache`` (results on disk), ``evaluation`` (candidates times
  flights);
- ``proposals`` and ``study`` (candidates and their trials), ``search`` (all generations),
  ``refinement`` (the best candidate without needless changes), ``tune`` (the whole study);
- ``parameter_files`` and ``yaml_edit`` (tuned YAML), ``study_text`` and ``study_files`` (outputs);
- ``sweep`` and ``sweep_table`` (a table instead of a search), ``report`` (HTML).

Only the commands ``quad tune`` and ``quad sweep`` import this package, so no other command waits
for optuna.
"""
