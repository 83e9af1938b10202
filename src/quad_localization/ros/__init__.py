"""The node ``amcl``."""
