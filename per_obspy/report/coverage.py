"""Coverage of a screening in sentences, for console, page and summaries."""

import re
from collections.abc import Mapping, Sequence

from per_obspy.errors import shortened
from per_obspy.report.texts import LANGUAGES, in_context, written
from per_obspy.results.coverage import OTHERS, Coverage, Search

#: Kinds of reasons that a sentence names.
NAMED = 4


def coverage_sentences(coverage: Coverage, language: str = "en") -> list[str]:
    """
    Return the coverage in sentences; the first one warns where a third or more has no verdict.

    Examples
    --------
    >>> coverage_sentences(Coverage(160, 77, {"no station within reach": 83}))[1]
    '77 of 160 rows of the pair table are screened; left out: 83 (83 no station within reach).'
    """
    texts, sentences = LANGUAGES[language], list[str]()
    counts = {
        "count": coverage.pairs - coverage.screened, "all": coverage.pairs,
        "rows": coverage.rows, "lost": coverage.rows - coverage.screened, "kept": coverage.screened,
    }  # fmt: skip
    values = {name: written(value, 0, language) for name, value in counts.items()}
    if coverage.lacks_many:
        sentences.append(texts["coverage_many"].format(**values, share=_lost_share(coverage)))
    if coverage.search:
        sentences.append(search_sentence(coverage.search, language))
    # Rows of the table, which are those that the search kept
    if not coverage.rows:
        return sentences
    if not counts["lost"]:
        return [*sentences, texts["coverage_all"].format(**values)]
    areas = _areas(coverage.areas, language)
    reasons = f"{kind_text(coverage.left_out, language)}{areas}"
    return [*sentences, f"{texts['coverage_some'].format(**values)} ({reasons})."]


def _lost_share(coverage: Coverage) -> int:
    """Return the pairs without a verdict in percent; 100 only if it is all."""
    share = round(100 * (coverage.pairs - coverage.screened) / coverage.pairs)
    return min(share, 99 if coverage.screened else 100)


def search_sentence(search: Search, language: str) -> str:
    """Return the account of a search in one sentence."""
    texts, lost = LANGUAGES[language], sum(search.left_out.values())
    counts = {"count": search.pairs, "all": search.neighbours, "lost": lost}
    values = {name: written(value, 0, language) for name, value in counts.items()}
    # Pairs first, then features of the layer
    text = texts["coverage_search" if lost else "coverage_search_all"].format(**values)
    if lost:
        text += f" ({kind_text(search.left_out, language)}{_areas(search.areas, language)})"
    if search.buildings:
        kinds = kind_text(search.buildings, language)
        text += f"; {texts['coverage_buildings'].format(kinds=kinds)}"
    if search.restricted:
        text += f"; {texts['coverage_licence'].format(sources=', '.join(search.restricted))}"
    return f"{text}."


def _areas(areas: Sequence[tuple[str, int]], language: str) -> str:
    """Return the areas with most rows left out, as the end of a sentence."""
    named = [f"{shortened(str(name), 40)}: {written(count, 0, language)}" for name, count in areas]
    text = LANGUAGES[language]["coverage_areas"]
    return f"; {text.format(areas=', '.join(named))}" if named else ""


def kind_text(kinds: Mapping[str, int], language: str) -> str:
    """
    Return counts of kinds of reasons, the largest first.

    Examples
    --------
    >>> kind_text({"gap: empty": 3, "no outline": 2}, "es")
    '3 separación: vacío, 2 sin contorno'
    """
    chosen = dict(kinds)
    # A sentence names the most frequent ones
    if len(kinds) > NAMED + 1:
        rest = sum(list(kinds.values())[NAMED:])
        chosen = dict(list(kinds.items())[:NAMED]) | {OTHERS: rest}
    return ", ".join(
        f"{written(count, 0, language)} {_kind(kind, language)}" for kind, count in chosen.items()
    )


def _kind(kind: str, language: str) -> str:
    """Return a kind of reason in a language: a sentence, or a column and its fault."""
    column, colon, fault = kind.partition(": ")
    if colon and re.fullmatch(r"[a-z_]+", column):
        return f"{in_context('reason', column, language)}: {in_context('reason', fault, language)}"
    return in_context("reason", kind, language)
