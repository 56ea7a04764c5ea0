"""From a traced System to its compiled kernels: series, lane code, scalar code, the module on disk
and its cache.
"""
