"""casadi graphs of one pose, one certified step, the forces and the motion."""
