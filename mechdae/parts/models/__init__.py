"""Models in a few lines: mechanisms by their lengths, and a builder from places in one pose."""
