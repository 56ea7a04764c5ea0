"""B. E. Saunders, R. Vasconcellos, R. J. Kuether and A. Abdelkefi (2021): what of it can't be a row
of a table.
"""
