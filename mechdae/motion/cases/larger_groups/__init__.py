"""Groups that have no closed form, solved at once."""
