"""The command `tribowatch`."""
