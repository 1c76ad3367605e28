"""Pictures of syntheses: designs, their comparison, how the starts converged, the census."""
