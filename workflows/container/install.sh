#!/bin/sh
# Install per_obspy into an environment of its own, and compile its kernels: the steps of the
# Dockerfile, which also work without a container.
#
#   install.sh install SOURCE FOLDER    SOURCE: a checkout or wheel; FOLDER: new virtual environment
#   install.sh compile FOLDER WORKFLOWS    WORKFLOWS: the folder with smoke.toml
#
# PYTHON names the interpreter (python3), EXTRAS the optional libraries (gis,notify).
# Kernels are kept in NUMBA_CACHE_DIR, else next to the package.
set -eu

case "${1:-}" in
install)
  extras=${EXTRAS-gis,notify}
  "${PYTHON:-python3}" -m venv "$3"
  "$3/bin/python" -m pip install --quiet --disable-pip-version-check --no-cache-dir "$2${extras:+[$extras]}"
  ;;
compile)
  results=$(mktemp -d)
  trap 'rm -rf "$results"' EXIT
  "$2/bin/per-obspy" run "$3/smoke.toml" -o "$results" --quiet
  "$2/bin/per-obspy" status "$results"
  ;;
*)
  sed -n '2,9s/^# \{0,1\}//p' "$0" >&2
  exit 2
  ;;
esac
