"""The candidates: the catalogue's causes and unlisted laws, as columns of one regression."""
