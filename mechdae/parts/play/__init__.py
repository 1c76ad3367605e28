"""Clearance of joints: how far outputs may wander, with bounds that are proved."""
