"""Compile the kernels of a traced System: series, lane code, scalar code, the module on disk and
its cache.
"""
