"""What a residual depends on, for what no listed cause explains."""
