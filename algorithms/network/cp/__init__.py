"""Network problems, whole or by windows, as models of CP-SAT."""
