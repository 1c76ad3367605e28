"""All solutions of systems of equations by paths through complex parameters."""
