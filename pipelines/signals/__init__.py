"""Process signals as arrays: filters, derivatives, block averages, spectra."""
