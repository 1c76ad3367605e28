"""Many sets of parameters, sensitivities, tolerances."""
