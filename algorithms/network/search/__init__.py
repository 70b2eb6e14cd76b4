"""Finding designs: first ones at once, better ones window by window."""
