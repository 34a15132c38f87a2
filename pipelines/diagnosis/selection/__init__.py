"""The posterior over sets of causes and unlisted laws that explain a session."""
