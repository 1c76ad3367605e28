"""All poses of spatial groups: by paths through complex dimensions, or in closed form."""
