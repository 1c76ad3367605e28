"""Commands that write documents: explanations, reports, assignments, certificates."""
