"""The nodes of localization: ``amcl``, ``slam``, ``map_server`` and ``map_saver``."""
