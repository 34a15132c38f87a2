"""The report: one page that shows what the other stages found; it computes nothing of its own but
running means."""
