"""The page of a recorded flight."""
