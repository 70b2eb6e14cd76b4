"""Streets and parcels together: blocks, templates, streamlines (UP)."""
