"""
Check that no function is packed: nodes of its body, comments per step, comprehensions per line.

Run it as ``python tests/check_density.py [PATH ...]``; it lists every violation and exits with 1 if
there is one. Expression contexts and operators are not counted as nodes.
"""

import ast
import io
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

#: Largest body in nodes, outside kernels and inside them (there more with a comment per step).
LARGEST, LARGEST_KERNEL = 150, 250

#: A body has at least one comment line for each of these nodes.
NODES_PER_COMMENT = 60

#: Node types that only repeat what another node says.
UNCOUNTED = (ast.expr_context, ast.operator, ast.unaryop, ast.cmpop, ast.boolop)

COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


def violations(path: Path) -> Iterator[str]:
    """Yield one line per violation in a file."""
    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    comments = comment_lines(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            for problem in problems_of(node, comments, is_kernel="kernels" in path.parts):
                yield f"{path}:{node.lineno}: {node.name} {problem}"
    lines = Counter(node.lineno for node in ast.walk(tree) if isinstance(node, COMPREHENSIONS))
    for line, count in sorted(lines.items()):
        if count > 1:
            yield f"{path}:{line}: {count} comprehensions on one line"
    for number, line in enumerate(source.splitlines(), start=1):
        if len(line) > 100:
            yield f"{path}:{number}: {len(line)} columns"


def problems_of(function: ast.FunctionDef, comments: set[int], is_kernel: bool) -> Iterator[str]:
    """Yield the violations of one function."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    nodes = sum(count_nodes(statement) for statement in body)
    needed = nodes // NODES_PER_COMMENT
    found = sum(function.lineno <= line <= (function.end_lineno or 0) for line in comments)
    if nodes > LARGEST and not is_kernel:
        yield f"has {nodes} nodes, at most {LARGEST}"
    elif nodes > LARGEST_KERNEL and found < needed:
        yield f"has {nodes} nodes, at most {LARGEST_KERNEL} unless every step has a comment"
    if nodes > NODES_PER_COMMENT and found < needed:
        yield f"has {nodes} nodes and {found} comments, needs {needed}"


def count_nodes(tree: ast.AST) -> int:
    """Count the nodes of a syntax tree."""
    return sum(not isinstance(node, UNCOUNTED) for node in ast.walk(tree))


def comment_lines(source: str) -> set[int]:
    """Return the numbers of lines with a comment."""
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return {token.start[0] for token in tokens if token.type == tokenize.COMMENT}


def main(arguments: list[str]) -> int:
    """Print the violations of files and folders; return the exit code."""
    roots = [Path(argument) for argument in arguments] or [Path("per_obspy")]
    files = [path for root in roots for path in ([root] if root.is_file() else root.rglob("*.py"))]
    found = [problem for path in sorted(files) for problem in violations(path)]
    print(*found, f"{len(found)} violations in {len(files)} files", sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
