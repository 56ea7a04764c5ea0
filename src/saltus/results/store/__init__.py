"""A map on disk, chunk by chunk, that any process may be killed over."""
