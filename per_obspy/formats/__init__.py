"""
ObsPy waveform plugins, one module a file format, detected by ``obspy.read`` on their own.

Every reader takes a path or an open binary file and gives a Stream whose traces speak the words of
``formats/vocabulary.py``. It always reads the whole file, even if only headers are asked for,
because a truncated record must not look whole. Whatever is wrong is a ``RecordRejected`` that names
the file, the line and the field.
"""
