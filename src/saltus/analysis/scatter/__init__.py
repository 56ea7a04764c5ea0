"""Motions of uncertain parameters: sets of values, their responses, and their statistics.

In the order of the work: `sets.py` draws the sets, `answers.py` computes what is asked of each,
`tracked.py` tells which responses of two sets are one, `numbers.py` has quantiles and Sobol
indices, `scatter.py` the verb.
"""
