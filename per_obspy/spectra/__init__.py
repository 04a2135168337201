"""
Arrays to spectra (one component, by azimuth, inelastic), a Stream to a station's Dataset, to netCDF and back.
"""
