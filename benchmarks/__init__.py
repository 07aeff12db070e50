"""Benchmarks: of the solvers against their peers, ``python -m benchmarks``; of what constants are worth."""
