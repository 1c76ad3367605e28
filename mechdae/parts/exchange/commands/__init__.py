"""Commands of formats and templates."""
