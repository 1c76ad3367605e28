"""casadi functions evaluated on arrays of poses."""
