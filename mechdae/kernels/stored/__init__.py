"""Kernels kept on disk between processes."""
