"""Newton's method on many small systems of equations at once, its tolerances, and multipliers."""
