"""Figures and pages: results in, pictures and words out. See ``figures.py`` for the list of all figures."""
