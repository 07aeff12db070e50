"""Benchmarks of relit's solvers against their peers: ``python -m benchmarks``."""
