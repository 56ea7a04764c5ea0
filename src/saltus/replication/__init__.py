"""Replications: a published paper's figures drawn again, and each of its claims held against the data, by one command.

A paper is a list of *jobs* (each gives one Dataset, kept in a file), *pictures* drawn from them, and *claims*, each with a rule in words and
a judge that applies it to the data. Nothing here knows a result in advance.
"""

from saltus.replication.job import Job, JobError
from saltus.replication.papers import Numbers, Paper, Picture, find, folder_of, names
from saltus.replication.run import Replication, reproduce
from saltus.replication.tables import claims_table, verdict_table
from saltus.replication.verdict import Check, Claim, Finding
from saltus.replication.workers import Progress

__all__ = [
    "Check",
    "Claim",
    "Finding",
    "Job",
    "JobError",
    "Numbers",
    "Paper",
    "Picture",
    "Progress",
    "Replication",
    "claims_table",
    "find",
    "folder_of",
    "names",
    "reproduce",
    "verdict_table",
]
