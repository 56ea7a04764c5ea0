"""What a user would pick instead, used as well as we know how: same job, same clock (CPU time of
one pinned core), same result.
"""
