"""Forces of gears, racks, belts and friction wheels, in the plane and in space."""
