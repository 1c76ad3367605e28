"""What a task asks for, in numbers: drivers, laws, scales, outputs."""
