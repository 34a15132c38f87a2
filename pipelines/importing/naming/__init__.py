"""What the name of a column says: its words, its unit, and its meaning."""
