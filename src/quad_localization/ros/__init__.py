"""Nodes of localization: a thin shell around the modules of this package."""
