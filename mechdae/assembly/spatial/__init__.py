"""All poses of spatial groups that paths through complex dimensions lead to."""
