"""Lower bounds, proven while a search runs."""
