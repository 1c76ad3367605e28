"""What bands are drawn as."""
