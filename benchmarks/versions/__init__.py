"""Two versions of the library side by side: the same bits, and how fast.

Run from the repository, with the interpreter that has the dependencies; OLD is any commit::

    python -m benchmarks.versions bits OLD [--studies] [--only WORDS]
    python -m benchmarks.versions speed OLD [--rounds N] [--only WORDS]
    python -m benchmarks.versions compile OLD [--rounds N]
    python -m benchmarks.versions load OLD [--rounds N]

``bits`` plays some hundred small cases with both versions and compares all that they leave, byte by byte. ``speed``
times kernels of both in turn. ``compile`` times the first use of a learner, with nothing compiled yet. ``load`` times
the paper's T-versions over their bases of both versions.

The old version is checked out into a worktree in the system's folder for temporary files, where it stays for the next
time; ``git worktree list`` shows it. The code in this package runs under both versions, so it uses the public names of
`tuckerl` only, and `names` knows what those were called before.
"""
