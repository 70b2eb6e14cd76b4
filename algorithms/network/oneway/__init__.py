"""One-way streets: bridges, and directions in which every place stays within reach."""
