"""
Check that docstrings, comments and messages use the words of the glossary.

Run it as ``python tests/check_words.py [PATH ...]``; it lists every violation and exits with 1 if
there is one. The package is checked in docstrings, comments and texts, tests and workflows in
docstrings, Markdown files outside of code blocks.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

#: Files and folders that are checked by default.
ROOTS = ("per_obspy", "tests", "workflows", "docs", "README.md", "CONTRIBUTING.md", "SECURITY.md")

#: Pattern -> replacement to look for, in texts of every kind.
WORDS = {
    r"\b(tell|tells|told)\b": "returns, contains, reports",
    r"\b(say|says|said)\b": "returns, contains, reports",
    r"\b(nobody|somebody|nowhere)\b": "the noun that is meant",
    r"\b(nothing|something)\b": "the noun that is meant",
    r"\b(stands|stood)\b": "is, occurs, replaces",
    r"\bbeside\b": "next to, in addition to",
    r"\bthe same of\b": "identical to `x` for",
    r"\b(one|a) (row|line|number|column|file|shard|record) a [a-z]+": "per",
}

#: Words that no docstring begins with: the first line is an imperative or a noun of the field.
FIRST_WORDS = ("what", "which", "how", "where", "give", "gives", "tell", "say")

#: Nodes with a docstring.
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def violations(path: Path) -> Iterator[str]:
    """Yield one line per violation in a file."""
    source = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        texts = _markdown(source)
    else:
        texts = _texts(source) if "per_obspy" in path.parts else _docstrings(source)
    for number, text in texts:
        for pattern, instead in WORDS.items():
            if found := re.search(pattern, text, re.IGNORECASE):
                yield f"{path}:{number}: {found.group()!r}: write {instead}"
    if path.suffix == ".py":
        yield from (f"{path}:{number}: {problem}" for number, problem in _first_lines(source))


def _docstrings(source: str) -> Iterator[tuple[int, str]]:
    """Yield number and text of the lines of docstrings."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node):
            text = node.body[0].value  # type: ignore[attr-defined]
            yield from enumerate(text.value.splitlines(), start=text.lineno)


def _texts(source: str) -> Iterator[tuple[int, str]]:
    """Yield number and text of lines with docstrings, comments or texts of several words."""
    kinds = (tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", -1))
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type in kinds and " " in token.string:
            yield from enumerate(token.string.splitlines(), start=token.start[0])


def _markdown(source: str) -> Iterator[tuple[int, str]]:
    """Yield number and text of lines outside of code blocks, without code in the line."""
    is_code = False
    for number, line in enumerate(source.splitlines(), start=1):
        if line.lstrip().startswith("```"):
            is_code = not is_code
        elif not is_code:
            yield number, re.sub(r"`[^`]*`|\([^)]*\.md[^)]*\)", "", line)


def _first_lines(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and problem of docstrings that begin with a forbidden word."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, DOCUMENTED) and (text := ast.get_docstring(node)):
            first = text.split()[0].strip(",.:`'\"").lower()
            if first in FIRST_WORDS:
                yield getattr(node, "lineno", 1), f"a docstring begins with {first!r}"


def main(arguments: list[str]) -> int:
    """Print the violations of files and folders; return the exit code."""
    roots = [Path(argument) for argument in arguments or ROOTS]
    files = [root for root in roots if root.is_file()]
    for root in (root for root in roots if root.is_dir()):
        # Generated pages repeat texts of the package
        found = (path for path in root.rglob("*") if "generated" not in path.parts)
        files += [path for path in found if path.suffix in (".py", ".md")]
    problems = [problem for path in sorted(files) for problem in violations(path)]
    print(*problems, f"{len(problems)} violations in {len(files)} files", sep="\n")
    return int(bool(problems))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
