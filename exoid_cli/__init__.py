"""The command line of exoid: reads, calls one function of pipelines, writes."""
