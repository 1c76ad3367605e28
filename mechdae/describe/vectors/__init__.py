"""Closed vector loops: vectors, loops and nodes that expand into bodies and joints."""
