"""Pictures of chains, schemes and rankings."""
