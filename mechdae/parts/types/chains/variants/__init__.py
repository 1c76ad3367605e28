"""What can be varied in one mechanism: orders, fixed links, kinds of pairs, constructions."""
