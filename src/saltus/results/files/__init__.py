"""Results to files and back: netCDF, CSV, MATLAB, pandas; measured points."""
