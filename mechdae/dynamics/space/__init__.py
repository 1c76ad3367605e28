"""What is different in space: sketches, reactions behind joints of a tree, a check of its own."""
