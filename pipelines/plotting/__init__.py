"""The style of exoid's matplotlib figures."""
