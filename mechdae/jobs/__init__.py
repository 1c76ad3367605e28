"""Many computations spread over processes, whatever they are."""
