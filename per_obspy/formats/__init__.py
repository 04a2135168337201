"""ObsPy waveform plugins, one module a file format, detected by ``obspy.read`` on their own."""
