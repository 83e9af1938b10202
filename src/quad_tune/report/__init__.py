"""Reports of studies and sweeps, built on the reports of flights.

Reading order: ``search_pictures`` (history, importances, values), ``outcome_pictures`` (time
against gap, base against tuned), ``tune_page``, ``sweep_page``.
"""
