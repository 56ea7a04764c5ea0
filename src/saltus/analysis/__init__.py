"""Analyses: one file per question a scientist asks. They speak to flows only, and answer with
Datasets.

Each verb is imported from its own file, so that asking one question doesn't load what the others
need.
"""
