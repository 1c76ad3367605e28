"""What is watched along a motion, and located where it happens."""
