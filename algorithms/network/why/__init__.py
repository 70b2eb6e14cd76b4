"""Why there is no design: reasons, conflicts, and what giving up each wish would give."""
