"""The programs that a user would pick instead, used as well as we know: same job, same clock (CPU
time of one pinned core), same result.
"""
