"""What only some mechanisms have, and how their motion differs: see `mechdae.additions`."""
