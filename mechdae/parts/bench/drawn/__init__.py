"""Pictures of speed against error."""
