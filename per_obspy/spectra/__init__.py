"""From arrays to spectra (one component, by azimuth, inelastic), from a Stream to a station's Dataset, to netCDF and back."""
