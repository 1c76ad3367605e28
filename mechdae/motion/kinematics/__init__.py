"""Tasks of position, velocity and acceleration: sweeps and assembly modes."""
