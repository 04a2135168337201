"""Arrays to spectra, a Stream to the Dataset of a station, and to netCDF and back."""
