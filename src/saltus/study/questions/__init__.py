"""The questions that a study may ask: one file each, with its table in the study file, its plan, its answer, its table and pictures."""
