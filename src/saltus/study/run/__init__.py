"""Running studies: answers in a folder, maps in crash-safe stores, threads, processes
and clusters.
"""
