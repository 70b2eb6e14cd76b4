"""Network problems as mixed-integer programs: ours, the paper's, and the solvers behind PuLP."""
