"""Outputs as casadi functions, and their derivatives by parameters."""
