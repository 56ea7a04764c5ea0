"""Studies at work: answers kept in a folder, maps in stores that survive anything, threads, processes and clusters."""
