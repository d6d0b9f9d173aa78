"""Files: how they are written and read, what is in them, and where they come from."""
