"""Types of mechanisms: chains, their variants, schemes of dyads, ranking."""
