"""The integer program of rooms: index, CP-SAT rows, linear rows, exact evaluation."""
