"""What a mechanism has to do, one module for each kind of goal."""
