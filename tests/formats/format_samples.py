"""One small file of every format, written from its layout with invented stations and values."""

import csmip_samples
import number_samples
import table_samples
from sample_file import MOTION, Sample

#: Writers of a motion of any length.
WRITERS = {
    "peer_at2": table_samples.peer_at2,
    "csmip_v1": csmip_samples.csmip_v1,
    "csmip_raw": csmip_samples.csmip_raw,
    "csmip_v2": csmip_samples.csmip_v2,
    "renadic": csmip_samples.renadic,
    "usc_v1": csmip_samples.usc_v1,
    "usc_v2": csmip_samples.usc_v2,
    "geonet_v1a": number_samples.geonet_v1a,
    "geonet_v2a": number_samples.geonet_v2a,
    "itaca": table_samples.itaca,
    "dyna": table_samples.dyna,
    "afad": table_samples.afad,
    "nsmn": table_samples.nsmn,
    "unam": table_samples.unam,
    "cwb": table_samples.cwb,
    "smc": number_samples.smc,
    "bhrc": number_samples.bhrc,
    "cosmos_v0c": number_samples.cosmos_v0c,
    "cosmos_v2c": number_samples.cosmos_v2c,
}

SAMPLES: dict[str, Sample] = {name: write(MOTION) for name, write in WRITERS.items()}
