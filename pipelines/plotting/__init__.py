"""Charts as data, panels of each kind of table, and figures of them."""
