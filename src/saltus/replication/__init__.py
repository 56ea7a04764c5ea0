"""Replications: the figures of a published paper drawn again, and its claims tested against the
data, by one command.

A paper is a folder of study files, *jobs* (each gives one Dataset, kept as a study keeps its
results), *pictures* drawn from them, and *claims*: rows with the quantities that decide them, rules
and limits. Nothing here knows a result in advance.
"""

from saltus.replication.job import Job
from saltus.replication.outcome import Replication
from saltus.replication.papers import Claim, Numbers, Paper, Picture, find, folder_of, names
from saltus.replication.run import reproduce
from saltus.replication.tables import claims_table, verdict_table
from saltus.replication.verdict import Check, Finding

__all__ = [
    "Check",
    "Claim",
    "Finding",
    "Job",
    "Numbers",
    "Paper",
    "Picture",
    "Replication",
    "claims_table",
    "find",
    "folder_of",
    "names",
    "reproduce",
    "verdict_table",
]
