"""How verdicts are worded: labels of causes, unlisted laws, findings."""
