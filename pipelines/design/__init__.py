"""Design an excitation: a particle swarm over Fourier coefficients, rated by its regressor."""
