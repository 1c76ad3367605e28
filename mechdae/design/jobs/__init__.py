"""Any computations spread over processes."""
