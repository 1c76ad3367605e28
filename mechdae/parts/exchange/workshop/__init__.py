"""Parts of a planar mechanism to cut or print: plates in layers, pins, spacers, a list."""
