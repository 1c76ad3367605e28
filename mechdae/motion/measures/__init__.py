"""What designers read off a sweep: one module for each measure, computed only on request."""
