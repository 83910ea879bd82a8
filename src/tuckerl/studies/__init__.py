"""What to run, running it, keeping it and comparing it; the paper's experiments as data."""
