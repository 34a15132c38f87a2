"""Signals as arrays: filtering, differentiation, blocks, noise floors. Knows nothing of legs."""
