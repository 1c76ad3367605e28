"""The kinematic diagram of one pose: bodies, joints, drivers, loads."""
