"""Buildings are placed: in stages or by a program."""
