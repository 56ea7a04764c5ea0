"""Independent truth: solvers that share no code with the package, for tests and benchmarks to be
held against.
"""
