"""The algorithms, one file each: its update, its compiled loop, its class."""
