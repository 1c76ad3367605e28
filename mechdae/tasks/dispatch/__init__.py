"""Tasks of one mechanism: sweeps, modes, reactions, motions, equilibria."""
