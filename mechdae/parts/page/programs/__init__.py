"""Kernels as programs in C and JavaScript."""
