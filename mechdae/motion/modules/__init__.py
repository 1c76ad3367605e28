"""The modules of vector loops: which there are, and all their solutions in closed form."""
