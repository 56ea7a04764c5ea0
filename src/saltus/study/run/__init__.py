"""Running studies: answers in a folder, chunks in crash-safe stores, threads, processes
and clusters.
"""
