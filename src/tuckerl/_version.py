"""The version, in one place: the build reads it from here and saved files carry it."""

__version__ = "0.1.0"
