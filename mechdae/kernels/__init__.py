"""From symbols to functions on arrays of poses."""
