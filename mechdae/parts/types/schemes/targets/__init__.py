"""Goals by targets: places that are visited, functions; their screening and descent."""
