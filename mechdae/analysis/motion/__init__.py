"""Motion under forces: start, integration, events, what is reported."""
