"""The verdict: the result of a diagnosis in JSON, in sentences, in tables and in figures."""
