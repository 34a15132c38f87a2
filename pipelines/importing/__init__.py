"""``exoid import``: recordings out of logs from elsewhere."""
