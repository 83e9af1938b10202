"""Reports of studies and sweeps, built on the reports of flights.

Reading order: ``panels`` (plots in a grid, on the page and on paper), ``tune_plots``,
``tune_page``, ``sweep_measures``, ``sweep_plot``, ``sweep_page``.
"""
