"""THE MACHINE, or its stand-in: what moves, what resists, what it sends."""
