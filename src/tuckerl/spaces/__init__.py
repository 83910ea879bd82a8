"""Encoders: numbers for the members of Gymnasium's spaces."""
