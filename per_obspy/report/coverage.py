"""Coverage of a screening in sentences, for console, page and summaries."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

from per_obspy.errors import shortened
from per_obspy.results.coverage import Coverage, Search

#: Kinds of reasons that a sentence names.
NAMED = 4

TEXTS: dict[str, dict[str, str]] = {
    "en": {
        "many": (
            "{count} of {all} neighbouring pairs ({share} %) have NO VERDICT: nothing here says "
            "that they are safe."
        ),
        "all": "All rows of the pair table are screened: {all}.",
        "some": "{count} of {all} rows of the pair table are screened; left out: {lost}",
        "search_all": "All neighbouring pairs of the outlines are in the pair table: {all}",
        "search": (
            "{count} of {all} neighbouring pairs of the outlines are in the pair table; "
            "left out: {lost}"
        ),
        "buildings": "outlines that are no usable building: {kinds}",
        "areas": "areas most affected: {areas}",
        "number_all": "pairs screened, all of the table",
        "number_some": "of {all} pairs are screened",
    },
    "es": {
        "many": (
            "{count} de {all} pares vecinos ({share} %) NO TIENEN VEREDICTO: nada aquí dice que "
            "sean seguros."
        ),
        "all": "Se evalúan todas las filas de la tabla de pares: {all}.",
        "some": "Se evalúan {count} de {all} filas de la tabla de pares; quedan fuera: {lost}",
        "search_all": "Todos los pares vecinos de los contornos están en la tabla: {all}",
        "search": (
            "{count} de {all} pares vecinos de los contornos están en la tabla de pares; "
            "quedaron fuera: {lost}"
        ),
        "buildings": "contornos que no son edificios utilizables: {kinds}",
        "areas": "zonas más afectadas: {areas}",
        "number_all": "pares evaluados, todos los de la tabla",
        "number_some": "de {all} pares evaluados",
    },
}

#: Kinds of reasons in Spanish; names of columns and other sentences stay.
_SPANISH = {
    "no motion on the ShakeMap": "sin movimiento en el ShakeMap",
    "outside the ShakeMap": "fuera del ShakeMap",
    "no height, storeys or period": "sin altura, pisos ni período",
    "no station within reach": "sin estación al alcance",
    "no station with coordinates": "sin estación con coordenadas",
    "outside the spectrum": "fuera del espectro",
    "footprints overlap": "contornos superpuestos",
    "no outline": "sin contorno",
    "invalid outline": "contorno inválido",
    "repeated": "repetido",
    "height and storeys disagree": "altura y pisos se contradicen",
    "contact height above the lower building": "altura de contacto sobre el edificio más bajo",
    "position 0, 0": "posición 0, 0",
    "positions too far apart": "posiciones demasiado separadas",
    "a building paired with itself": "un edificio consigo mismo",
    "broken line": "línea rota",
    "no probability in every scenario": "sin probabilidad en cada escenario",
    "left out of every scenario": "fuera de todos los escenarios",
    "scenarios disagree": "los escenarios se contradicen",
    "other reasons": "otras razones",
    "empty": "vacío",
    "no number": "no es un número",
    "out of range": "fuera de rango",
    "unknown word": "palabra desconocida",
    "gap": "separación",
    "height": "altura",
    "storeys": "pisos",
    "period": "período",
    "damping": "amortiguamiento",
    "longitude": "longitud",
    "latitude": "latitud",
}


def coverage_sentences(coverage: Coverage, language: Literal["en", "es"] = "en") -> list[str]:
    """
    Return the coverage in sentences; the first one warns where a third or more has no verdict.

    Examples
    --------
    >>> coverage_sentences(Coverage(160, 77, {"no station within reach": 83}))[1]
    '77 of 160 rows of the pair table are screened; left out: 83 (83 no station within reach).'
    """
    texts, sentences = TEXTS[language], list[str]()
    if coverage.lacks_many:
        lost = coverage.pairs - coverage.screened
        # 100 only if it is all
        share = min(round(100 * lost / coverage.pairs), 99 if coverage.screened else 100)
        sentences.append(texts["many"].format(count=lost, all=coverage.pairs, share=str(share)))
    if coverage.search:
        sentences.append(search_sentence(coverage.search, language))
    # Rows of the table, which are those that the search kept
    if not coverage.rows:
        return sentences
    lost = coverage.rows - coverage.screened
    if not lost:
        return [*sentences, texts["all"].format(all=coverage.rows)]
    some = texts["some"].format(count=coverage.screened, all=coverage.rows, lost=lost)
    areas = _areas(coverage.areas, language)
    return [*sentences, f"{some} ({kind_text(coverage.left_out, language)}{areas})."]


def coverage_number(
    coverage: Coverage,
    language: Literal["en", "es"] = "en",
    shown: Callable[[int], str] = str,
) -> tuple[str, str]:
    """Return the first number of a screening, pairs with a verdict, and its meaning."""
    lost = coverage.pairs - coverage.screened
    key = "number_some" if lost else "number_all"
    return shown(coverage.screened), TEXTS[language][key].format(all=shown(coverage.pairs))


def search_sentence(search: Search, language: str) -> str:
    """Return the account of a search in one sentence."""
    texts, lost = TEXTS[language], sum(search.left_out.values())
    key = "search" if lost else "search_all"
    # Pairs first, then features of the layer
    text = texts[key].format(count=search.pairs, all=search.neighbours, lost=lost)
    if lost:
        text += f" ({kind_text(search.left_out, language)}{_areas(search.areas, language)})"
    if search.buildings:
        text += f"; {texts['buildings'].format(kinds=kind_text(search.buildings, language))}"
    return f"{text}."


def _areas(areas: Sequence[tuple[str, int]], language: str) -> str:
    """Return the areas with most rows left out, as the end of a sentence."""
    named = [f"{shortened(str(name), 40)}: {count}" for name, count in areas]
    return f"; {TEXTS[language]['areas'].format(areas=', '.join(named))}" if named else ""


def kind_text(kinds: Mapping[str, int], language: str) -> str:
    """
    Return counts of kinds of reasons, the largest first.

    Examples
    --------
    >>> kind_text({"gap: empty": 3, "no outline": 2}, "es")
    '3 separación: vacío, 2 sin contorno'
    """
    parts = [f"{count} {_kind(kind, language)}" for kind, count in kinds.items()]
    # A sentence names the most frequent ones
    rest = sum(list(kinds.values())[NAMED:])
    if rest and len(kinds) > NAMED + 1:
        return ", ".join([*parts[:NAMED], f"{rest} {_kind('other reasons', language)}"])
    return ", ".join(parts)


def _kind(kind: str, language: str) -> str:
    """Return a kind of reason in a language."""
    if language == "en" or kind in _SPANISH:
        return kind if language == "en" else _SPANISH[kind]
    column, colon, fault = kind.partition(": ")
    if not colon or not re.fullmatch(r"[a-z_]+", column):
        return kind
    return f"{_SPANISH.get(column, column)}: {_SPANISH.get(fault, fault)}"
