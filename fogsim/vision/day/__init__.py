"""One forward model of rows of road and sky by day, its hypotheses compared by their evidence."""
