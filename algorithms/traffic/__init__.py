"""Traffic on streets: demand, assignment, equilibrium and simulation (CND 5.1)."""
