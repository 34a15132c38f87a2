"""The excitation: a particle swarm over Fourier coefficients, judged by what the regressor can tell
apart."""
