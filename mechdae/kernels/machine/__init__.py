"""A register machine in C for casadi's functions, where it was built; see `program`."""
