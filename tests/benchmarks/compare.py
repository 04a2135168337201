"""
Name the figures that became worse by more than a tenth from one file of benchmarks to another.

    python tests/benchmarks/compare.py OLD NEW

Exit code 1 if there are any, 2 if the files cannot be compared: one is damaged, they have no figure
in common, or they have no machine in common, where ratios are printed all the same. Figures of
machines that only one file has are left out otherwise, and peers always. Only figures of a machine
in the same state compare: the load before each script is printed with its figures.
"""

import sys
from pathlib import Path

from figures import LESS_IS_BETTER, Damaged, Figure, read

#: Smallest ratio that is named.
WORSE = 1.1


def common_machines(old: list[Figure], new: list[Figure]) -> set[str]:
    """Return the machines on which figures of both files were measured."""
    return {one["machine"] for one in old} & {one["machine"] for one in new}


def _key(figure: Figure, machines: set[str]) -> tuple[str, str, str]:
    """Return machine, script and name of a figure; no machine if the files share none."""
    return figure["machine"] if machines else "", figure["script"], figure["name"]


def worse(old: list[Figure], new: list[Figure]) -> tuple[list[str], int]:
    """Return a line per figure that became worse or is missing, and how many were compared."""
    machines = common_machines(old, new)
    later = {_key(one, machines): one for one in new}
    lines, compared = [], 0
    for one in old:
        if one["peer"] or (machines and one["machine"] not in machines):
            continue
        place = f"{one['script']}: {one['name']}"
        other = later.get(_key(one, machines))
        if other is None or other["unit"] != one["unit"]:
            lines.append(f"{place}: not in the new file")
            continue
        compared += 1
        ratio = other["value"] / one["value"]
        ratio = ratio if one["unit"] in LESS_IS_BETTER else 1.0 / ratio
        if ratio > WORSE:
            lines.append(
                f"{place}: {one['value']:g} -> {other['value']:g} {one['unit']}, "
                f"{ratio:.2f} times worse (load {one['load_before']} -> {other['load_before']})"
            )
    return lines, compared


def main(old: Path, new: Path) -> int:
    """Print the worse figures, and return the exit code."""
    try:
        before, after = read(old), read(new)
    except Damaged as damaged:
        print(damaged, file=sys.stderr)
        return 2
    are_alike = bool(common_machines(before, after))
    if not are_alike:
        machines = {one["machine"] for one in before + after}
        print(f"different machines: {'; '.join(sorted(machines))}")
    lines, compared = worse(before, after)
    print("\n".join([*lines, f"{compared} figures compared"]))
    if not compared or not are_alike:
        return 2
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
