"""Templates of kernels and their pure helpers: numbers in, numbers out, nothing allocated in a
loop, nothing raised.
"""
