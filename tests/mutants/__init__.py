"""Small wrong changes of the sources, to see whether the tests notice them: ``python -m tests.mutants --help``."""
