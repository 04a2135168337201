"""Sentences of the summary in English and Spanish, by keys; numbers keep the decimal point."""

from collections.abc import Mapping

from per_obspy.report.page.texts import Language

ENGLISH: dict[str, str] = {
    # The event
    "event_time": "Earthquake of {time} UTC.",
    "first_record": "Origin time unknown; first record {time} UTC.",
    "magnitude": "Magnitude {value}.",
    "epicentre": "Epicentre {place}.",
    "epicentre_depth": "Epicentre {place}, depth {depth} km.",
    "north": "north",
    "south": "south",
    "east": "east",
    "west": "west",
    # Where the motion comes from
    "shakemap": "Motion of ShakeMap {name}, version {version}, where no station is in reach.",
    "spectrum_title": "Design spectrum {name}",
    "spectrum": "Screened by the spectrum {name}, not by an earthquake.",
    "scenarios": "{count} scenarios together.",
    "scenario_rate": "{name}: {value} a year.",
    "scenario_weight": "{name}: {value} in weight.",
    "no_station": "No station: the motion is not that of records.",
    "stations_used": "Stations used, {count}{names}.",
    "stations_missing": "Stations missing or refused, {count}{names}.",
    "none_missing": "No station of the folder is missing.",
    "and_more": " and {count} more",
    # Warnings and titles
    "simulated": "SIMULATED ground motion: this is not an earthquake",
    "simulated_spoken": "SIMULATED. THIS IS NOT AN EARTHQUAKE.",
    "five_numbers": "Five numbers",
    "what_first": "What to do first",
    "worst_pairs": "The worst pairs",
    "worst_buildings": "The worst buildings",
    "how_sure": "How sure",
    "made_by": "Source",
    # Five numbers
    "number_pounding": "pairs that pound or are likely to",
    "number_expected": "pairs expected to pound in all",
    "number_class": "pairs of the worst class, {name}",
    "number_velocity": "largest expected impact velocity",
    # Steps
    "inspect": "Inspect the pairs below in their order, at the joint between them.",
    "area_first": "Most pounding is expected in area {area}: go there first.",
    "around": "{name}, around {place}",
    "measure": "Measure the unknown gaps; pairs with one: {count}.",
    "exercise": "Do not act on this as on an earthquake: its motion is simulated.",
    # Doubts
    "open": "Open pairs, neither a clear yes nor a clear no: {count}.",
    "derived": "Pairs with derived inputs, such as periods by height: {count}.",
    "far": "Pairs far from their station: {count}.",
    "nature": "This is a screening. It replaces no inspection, and a no is not a promise.",
    # One pair or building
    "impact": "impact {speed}",
    "contact": "contact in {chance}",
    "severity": "severity {speed}",
    "at": "at {place}",
    # The page
    "head_pair": "pair",
    "head_class": "class",
    "head_impact": "impact",
    "head_contact": "contact",
    "head_gap": "gap",
    "head_needed": "needed",
    "head_place": "latitude, longitude",
    "map_title": "{count} pairs shown",
    "map_east": "longitude (°E)",
    "map_north": "latitude (°N)",
    "made": "per-obspy {version}. All numbers and their units: {table}.csv.",
    # Rest of the page report.html
    "page_content": "content",
    "page_design": (
        "A spectrum has neither stations nor displacement histories, and no rows of buildings: the "
        "page leaves them out."
    ),
    "page_shakemap": (
        "Pairs without a station have no displacement history: a ShakeMap is no record."
    ),
    "page_ensemble": (
        "Lines, buildings and outlines are those of the first scenario with results; histories are "
        "of the worst scenario of each pair, where it has a record. Rows of buildings are in the "
        "results of each scenario."
    ),
}

SPANISH: dict[str, str] = {
    "event_time": "Sismo del {time} UTC.",
    "first_record": "Hora de origen desconocida; primer registro {time} UTC.",
    "magnitude": "Magnitud {value}.",
    "epicentre": "Epicentro {place}.",
    "epicentre_depth": "Epicentro {place}, profundidad {depth} km.",
    "north": "norte",
    "south": "sur",
    "east": "este",
    "west": "oeste",
    "shakemap": "Movimiento del ShakeMap {name}, versión {version}, donde no hay estación cercana.",
    "spectrum_title": "Espectro de diseño {name}",
    "spectrum": "Evaluado con el espectro {name}, no con un sismo.",
    "scenarios": "{count} escenarios juntos.",
    "scenario_rate": "{name}: tasa anual {value}.",
    "scenario_weight": "{name}: peso {value}.",
    "no_station": "Sin estaciones: el movimiento no es de registros.",
    "stations_used": "Estaciones usadas, {count}{names}.",
    "stations_missing": "Estaciones faltantes o rechazadas, {count}{names}.",
    "none_missing": "No falta ninguna estación de la carpeta.",
    "and_more": " y {count} más",
    "simulated": "Movimiento SIMULADO: esto no es un sismo",
    "simulated_spoken": "SIMULADO. ESTO NO ES UN SISMO.",
    "five_numbers": "Cinco números",
    "what_first": "Qué hacer primero",
    "worst_pairs": "Los peores pares",
    "worst_buildings": "Los peores edificios",
    "how_sure": "Qué tan seguro es",
    "made_by": "Fuente",
    "number_pounding": "pares que chocan o probablemente chocan",
    "number_expected": "choques esperados en total",
    "number_class": "pares de la peor clase, {name}",
    "number_velocity": "mayor velocidad de impacto esperada",
    "inspect": "Inspeccione los pares de abajo en su orden, en la junta entre ambos edificios.",
    "area_first": "La zona con más choques esperados es {area}: empiece allí.",
    "around": "{name}, alrededor de {place}",
    "measure": "Mida las separaciones desconocidas; pares con una: {count}.",
    "exercise": "No actúe como en un sismo: el movimiento es simulado.",
    "open": "Pares abiertos, ni un sí claro ni un no claro: {count}.",
    "derived": "Pares con datos derivados, como períodos según la altura: {count}.",
    "far": "Pares lejos de su estación: {count}.",
    "nature": "Esto es una evaluación rápida: no sustituye una inspección, y un no no es promesa.",
    "impact": "impacto {speed}",
    "contact": "contacto en {chance}",
    "severity": "severidad {speed}",
    "at": "en {place}",
    "head_pair": "par",
    "head_class": "clase",
    "head_impact": "impacto",
    "head_contact": "contacto",
    "head_gap": "hay",
    "head_needed": "necesaria",
    "head_place": "latitud, longitud",
    "map_title": "{count} pares",
    "map_east": "longitud (°E)",
    "map_north": "latitud (°N)",
    "made": "per-obspy {version}. Todos los números y sus unidades: {table}.csv.",
    "page_content": "contenido",
    "page_design": (
        "Un espectro no tiene estaciones ni historias de desplazamiento, ni filas de edificios: la "
        "página no los muestra."
    ),
    "page_shakemap": (
        "Los pares sin estación no tienen historia de desplazamiento: un ShakeMap no es un "
        "registro."
    ),
    "page_ensemble": (
        "Las líneas, los edificios y sus contornos son los del primer escenario con resultados; "
        "las historias son las del peor escenario de cada par, donde hay registro. Las filas de "
        "edificios están en los resultados de cada escenario."
    ),
}

#: Number words of one pair as English writes them -> Spanish.
_SPANISH_CHANCES = {
    "over ": "más de ",
    "under ": "menos de ",
    " of ": " de ",
    "unknown": "sin dato",
}

WORDING: Mapping[Language, Mapping[str, str]] = {"en": ENGLISH, "es": SPANISH}


def in_language(number: str, language: Language) -> str:
    """
    Return a number in words as a language writes it.

    Parameters
    ----------
    number : str
        From :mod:`per_obspy.report.words`.
    language : {'en', 'es'}
        Of the summary.

    Examples
    --------
    >>> in_language("over 99 of 100", "es"), in_language("84 of 100", "en")
    ('más de 99 de 100', '84 of 100')
    """
    if language == "en":
        return number
    for english, spanish in _SPANISH_CHANCES.items():
        number = number.replace(english, spanish)
    return number
