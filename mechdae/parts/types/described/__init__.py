"""What is asked of a composition."""
