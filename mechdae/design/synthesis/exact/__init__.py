"""All four-bars of exact goals: complex solutions by paths, certified, with verdicts."""
