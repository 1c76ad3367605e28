"""All poses of arms with six turning axes: closed forms, an eliminant, certificates."""
