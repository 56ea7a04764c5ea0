"""Templates of kernels and their pure helpers: functions of numbers that allocate nothing in a loop
and raise nothing.
"""
