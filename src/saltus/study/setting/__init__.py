"""Setting that all questions of a study share: its system, its units, the files that it names."""
