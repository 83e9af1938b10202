"""Pages and pictures of studies and sweeps, on the machinery of flights' reports.

Read ``search_pictures`` (history, importances, values), ``outcome_pictures`` (time against
clearance, before and after), ``tune_page``, ``sweep_pictures`` and ``sweep_page``.
"""
