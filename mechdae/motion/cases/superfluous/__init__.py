"""Groups with more equations than coordinates."""
