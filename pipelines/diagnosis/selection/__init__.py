"""Which causes and unlisted laws explain a session: a posterior over sets of them."""
