"""Content of a study file, read strictly: only texts and numbers, nothing is executed."""
