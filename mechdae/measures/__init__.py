"""What designers read off a sweep; one module for each measure, nothing unless asked for."""
