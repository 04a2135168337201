"""Fixed phrases of other modules in Spanish: warnings, reasons of rejections, prevention."""

import re

#: English phrase, as the module that writes it has it -> Spanish phrase.
SPANISH_PHRASES: dict[str, str] = {
    # Prevention of buildings
    "no measure for the likeliest inputs: its gaps are enough": (
        "ninguna medida para los datos más probables: sus separaciones bastan"
    ),
    "wider gaps elsewhere in its row: its own are enough for each pair alone": (
        "separaciones más anchas en otra parte de su fila: las suyas bastan para cada par solo"
    ),
    "measure the gaps that are not known": "medir las separaciones que no se conocen",
    "up to ": "hasta ",
    " m more gap (to ": " m más de separación (primero a ",
    " first)": ")",
    "or ": "o ",
    " of critical more damping in it and its neighbours": (
        " del crítico más de amortiguamiento en él y sus vecinos"
    ),
    "softened by bumpers of restitution ": "suavizado con topes de restitución ",
    " or less": " o menos",
    # Checks of records
    ", needs ": ", necesita ",
    ", allowed ": ", se permite ",
    "sampling rate, Hz:": "frecuencia de muestreo, Hz:",
    "duration, s:": "duración, s:",
    "different values (dead channel):": "valores distintos (canal muerto):",
    "samples are no record": "muestras no son un registro",
    "different values in": "valores distintos en",
    "clipped: ": "saturado: ",
    "equal samples at an extreme": "muestras iguales en un extremo",
    "peak over the full scale of a 24-bit counter:": (
        "máximo sobre la escala completa de un contador de 24 bits:"
    ),
    "dropout, s without change:": "corte, s sin cambio:",
    "spike or step, over its vicinity:": "pico o salto, sobre su vecindad:",
    "zero crossings a second:": "cruces por cero por segundo:",
    "late trigger: first second over the peak:": (
        "disparo tardío: primer segundo sobre el máximo:"
    ),
    "ends while shaking: last second over the peak:": (
        "termina mientras tiembla: último segundo sobre el máximo:"
    ),
    "another event, over the peak:": "otro evento, sobre el máximo:",
    "signal-to-noise ratio of the best octave": "relación señal-ruido de la mejor octava",
    "signal-to-noise ratio in": "relación señal-ruido en",
    "low-pass over high-pass corner:": "corte alto sobre corte bajo:",
    "the baseline may have shifted during the shaking: PER beyond": (
        "la línea base pudo desplazarse durante el sismo: PER más allá de"
    ),
    " s depends on when": " s depende de cuándo",
    "the baseline shifted during the shaking: velocity that stayed, over the peak velocity": (
        "la línea base se desplazó durante el sismo: velocidad que quedó, sobre la máxima"
    ),
    "displacement drifts with every baseline and the corner at": (
        "el desplazamiento deriva con toda línea base y el corte en"
    ),
    "no horizontal of its instrument is usable": (
        "ninguna horizontal de su instrumento es utilizable"
    ),
    "the instrument of": "el instrumento de",
    "at the same station goes first": "en la misma estación va primero",
    "its coordinates are unknown: it serves no pair": (
        "se desconocen sus coordenadas: no sirve a ningún par"
    ),
    "belongs to another earthquake: starts": "pertenece a otro sismo: empieza",
    "the screened one": "el evaluado",
    "counts without a response or a calibration factor": (
        "cuentas sin respuesta ni factor de calibración"
    ),
    # Rows of tables
    "nearest station": "la estación más cercana",
    " is too far": " está demasiado lejos",
    " m away, beyond ": " m de distancia, más allá de ",
    "no station has coordinates": "ninguna estación tiene coordenadas",
    " is not a number": " no es un número",
    " is empty": " está vacío",
    " is outside ": " está fuera de ",
    "is unknown, expected ": "se desconoce, se espera ",
    " or more": " o más",
    "occurs in an earlier row already": "ya está en una fila anterior",
    "is a number, one is needed": "es un número, hace falta uno",
    "is above the lower building": "está sobre el edificio más bajo",
    "is a placeholder, not a position": "es un relleno, no una posición",
    "a building has no gap to itself": "un edificio no tiene separación consigo mismo",
    "is neither 0 nor 1": "no es ni 0 ni 1",
    " km apart": " km de distancia",
    "given in millimetres or centimetres by mistake?": "¿dado en milímetros o centímetros?",
}

#: Words that may be part of a name: translated only where a sentence begins.
BEGINNINGS = ("up to ", "or ")


def _pattern() -> re.Pattern[str]:
    """Return a pattern of all phrases, the longest first, so that longer ones match first."""
    phrases = sorted(SPANISH_PHRASES, key=len, reverse=True)
    parts = [
        f"(?:^|(?<=; )){re.escape(phrase)}" if phrase in BEGINNINGS else re.escape(phrase)
        for phrase in phrases
    ]
    return re.compile("|".join(parts))


_PHRASES = _pattern()


def in_spanish(text: str) -> str:
    """
    Translate the fixed phrases of a text into Spanish; numbers, names and other words stay.

    Examples
    --------
    >>> in_spanish("HNZ: duration, s: 3, needs 10")
    'HNZ: duración, s: 3, necesita 10'
    """
    return _PHRASES.sub(lambda found: SPANISH_PHRASES[found[0]], text)
