"""Episodes and curves in, tables out: runs, cells, comparisons, correlations, claims. No figure, no report."""
