"""Maps on disk, chunk by chunk. Killed processes leave them intact."""
