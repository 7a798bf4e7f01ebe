"""The files of the page, and the shell they stand in."""
