"""Know where the robots are: maps, and localization in them."""
