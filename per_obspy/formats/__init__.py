"""
ObsPy waveform plugins, one module per file format, detected by ``obspy.read`` without being named.

Every reader takes a path or an open binary file and gives a Stream whose traces have the words of
``formats/text/vocabulary.py``. It always reads the whole file, even if only headers are requested,
because a truncated record must not look whole. Any fault is a ``RecordRejected`` that names the
file, the line and the field.
"""
