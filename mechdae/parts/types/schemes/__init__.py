"""Type and dimensions together: schemes of dyads that trace a curve, searched and certified."""
