"""Named effects, one file each."""
