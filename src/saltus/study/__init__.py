"""Studies: a TOML file that states what to compute is read strictly, run, and reported as plain
tables.

Nothing in a study file is ever executed: it names a model that comes with saltus, values, a method
and an analysis. A system of one's own is given on the command line, by the person who runs it.
"""
