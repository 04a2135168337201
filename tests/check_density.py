"""
Check that no function is packed, and print how large the package is, room by room.

Run it as ``python tests/check_density.py [PATH ...]``; it lists every violation (nodes of a body,
comments per step, comprehensions per line, columns) and exits with 1 if there is one. The figures
of size fail nothing: they are there to be seen by whoever adds a thousand lines. Expression
contexts and operators are not counted as nodes.
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


#: Figures of one module or room, as they are printed.
FIGURES = (
    "modules",
    "lines",
    "functions",
    "nodes",
    "nodes per code line",
    "used once",
    "one importer",
)


def print_sizes(files: list[Path]) -> None:
    """Print the figures of every room and of the whole package."""
    trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in files}
    uses = Counter(name for tree in trees.values() for name in names_used(tree))
    importers = Counter(target for tree in trees.values() for target in imported_modules(tree))
    rooms: dict[str, Counter[str]] = {}
    for path, tree in trees.items():
        room = path.parts[1] if len(path.parts) > 2 else "(root)"
        for name in (room, "sum"):
            rooms.setdefault(name, Counter()).update(size_of(path, tree, uses, importers))
    rooms["sum"] = rooms.pop("sum")
    print("room         " + "".join(f"{name:>{len(name) + 2}}" for name in FIGURES))
    for name, sizes in rooms.items():
        sizes["nodes per code line"] = round(sizes["nodes"] / max(sizes["code lines"], 1), 1)
        print(f"{name:13}" + "".join(f"{sizes[one]:>{len(one) + 2}}" for one in FIGURES))


def size_of(
    path: Path, tree: ast.Module, uses: Counter[str], importers: Counter[str]
) -> Counter[str]:
    """Count lines, functions and nodes of a module, and what stands alone in it."""
    source = path.read_text(encoding="utf-8").splitlines()
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    short = [node for node in functions if lines_of_body(node) <= 3 and uses[node.name] == 1]
    module = ".".join(path.with_suffix("").parts)
    return Counter({
        "modules": 1,
        "lines": len(source),
        "code lines": len(code_lines(tree)),
        "functions": len(functions),
        "nodes": count_nodes(tree),
        "used once": len(short),
        "one importer": int(importers[module] == 1),
    })  # fmt: skip


def names_used(tree: ast.Module) -> Iterator[str]:
    """Yield every name and attribute that a module reads, imports left out."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr


def imported_modules(tree: ast.Module) -> set[str]:
    """Return the names that a module imports, as modules and as members of modules."""
    targets = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            targets |= {node.module} | {f"{node.module}.{name.name}" for name in node.names}
        elif isinstance(node, ast.Import):
            targets |= {name.name for name in node.names}
    return targets


def lines_of_body(function: ast.FunctionDef) -> int:
    """Count the lines of a function below its signature and docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def code_lines(tree: ast.Module) -> set[int]:
    """Return the numbers of lines with a statement, docstrings left out."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if isinstance(node, ast.stmt) and not is_text:
            lines |= set(range(node.lineno, (node.end_lineno or 0) + 1))
        elif is_text:
            lines -= set(range(node.lineno, (node.end_lineno or 0) + 1))
    return lines


def main(arguments: list[str]) -> int:
    """Print the violations of files and folders, and their size; return the exit code."""
    roots = [Path(argument) for argument in arguments] or [Path("per_obspy")]
    files = [path for root in roots for path in ([root] if root.is_file() else root.rglob("*.py"))]
    print_sizes(sorted(files))
    found = [problem for path in sorted(files) for problem in violations(path)]
    print(*found, f"{len(found)} violations in {len(files)} files", sep="\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
