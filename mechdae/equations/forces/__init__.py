"""Forces as symbols: loads, inertia, friction, meshes."""
