"""Speed as ratios to peers in one run: ``make bench``.

Absolute times depend on the machine and the moment; so every figure is taken next to its peer's, in turn, and the
median of the paired ratios is what to quote.
"""
