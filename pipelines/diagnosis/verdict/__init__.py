"""The verdict: what a diagnosis says in JSON, in sentences, in tables and in figures."""
