"""Trees of links with loops: formats of simulators of robots."""
