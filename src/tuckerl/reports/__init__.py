"""Figures and the HTML page: a summary in, a picture out."""
