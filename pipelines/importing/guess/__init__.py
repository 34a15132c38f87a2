"""A first map of a log, from its names, its ranges and whether its columns agree."""
