"""Motion under forces: start, integration, what is reported."""
