"""From a mechanism to symbols: residuals, Jacobian, structure, reduction. No numbers."""
