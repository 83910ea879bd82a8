"""What makes a problem of somebody else's environment."""
