#!/bin/sh
# Install per_obspy into an environment of its own, compile its kernels, check the program: the
# steps of the Dockerfile, which also work without a container.
#
#   install.sh install SOURCE FOLDER    SOURCE: a checkout or wheel; FOLDER: new virtual environment
#   install.sh compile FOLDER    minutes of processor time; no kernel with WARM_UP=no
#   install.sh check FOLDER    ask for the health of a watcher that has no event open, without rights
#   install.sh start FOLDER ...    the program, with kernels that nobody but its user may write
#
# PYTHON names the interpreter (python3), EXTRAS the optional libraries (gis,notify), CONSTRAINTS the
# versions (those of constraints.txt, with which the project is tested; empty: any that fit).
# Kernels are kept in NUMBA_CACHE_DIR, else next to the package.
set -eu

case "${1:-}" in
install)
  extras=${EXTRAS-gis,notify}
  constraints=${CONSTRAINTS-$(dirname "$0")/constraints.txt}
  "${PYTHON:-python3}" -m venv "$3"
  "$3/bin/python" -m pip install --quiet --disable-pip-version-check \
    ${constraints:+--constraint "$constraints"} "$2${extras:+[$extras]}"
  ;;
compile)
  if [ "${WARM_UP:-yes}" = no ]; then
    echo "no kernels are compiled, as WARM_UP=no: the first run does it"
  else
    "$2/bin/per-obspy" warm-up
  fi
  ;;
check)
  # Kernels are code: whoever can write them runs as whoever loads them
  for cache in "${NUMBA_CACHE_DIR:-}" "${MPLCONFIGDIR:-}"; do
    if [ -d "$cache" ] && [ -n "$(find "$cache" ! -type l -perm -o+w | head -n 1)" ]; then
      echo "$cache: others may write there" >&2
      exit 1
    fi
  done
  program=$(cd "$2/bin" && pwd)/per-obspy
  watched=$(mktemp -d)
  trap 'rm -rf "$watched"' EXIT
  echo '{}' >"$watched/status.json"
  chmod -R a+rX "$watched"
  # root becomes the user of no rights, if that one can reach the interpreter
  without_rights="setpriv --reuid=65534 --regid=65534 --clear-groups"
  if [ "$(id -u)" != 0 ]; then
    without_rights=
  elif ! $without_rights "$2/bin/python" -c "" 2>/dev/null; then
    echo "checked as root: the user of no rights cannot start $2/bin/python" >&2
    without_rights=
  fi
  cd "$watched"
  $without_rights "$program" status "$watched"
  ;;
start)
  program=$2/bin/per-obspy
  shift 2
  # Another user than that of the image (docker run --user) works with a copy of its own
  for name in NUMBA_CACHE_DIR MPLCONFIGDIR; do
    eval "cache=\${$name:-}"
    if [ -d "$cache" ] && [ ! -O "$cache" ]; then
      own=$(mktemp -d)
      cp -R "$cache/." "$own"
      export "$name=$own"
    fi
  done
  exec "$program" "$@"
  ;;
*)
  sed -n '2,12s/^# \{0,1\}//p' "$0" >&2
  exit 2
  ;;
esac
