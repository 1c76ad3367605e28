"""What fronts of several objectives report, and where they have holes."""
