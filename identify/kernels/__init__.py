"""Compiled kernels of the identification."""
