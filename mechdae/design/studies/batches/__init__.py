"""Many sets of numbers of one mechanism at once: every set is a lane with a clock of its own."""
