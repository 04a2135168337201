# `make demo` and `make test` need Python 3.11 or newer and nothing else; they install into .venv.
# Run a command of the environment as .venv/bin/per-obspy, or activate it: source .venv/bin/activate
PYTHON ?= python3
BIN := .venv/bin
# Where a machine forbids compiled modules, every process would compile package and tests anew
unexport PYTHONDONTWRITEBYTECODE
# Modules are compiled when they are imported first: most of the libraries' never are
export PIP_COMPILE ?= 0

.PHONY: demo figures test test-long workflows rehearsal check docs wheel benchmark extras constraints clean

demo: .venv/run
	@echo "== simulate an earthquake, process its records, screen 2 000 pairs of buildings"
	$(BIN)/per-obspy run workflows/demo.toml
	@echo "== open output/demo/report.html in a browser; the worst pair in words:"
	@echo "     $(BIN)/per-obspy show '#1' output/demo"
	@echo "== your own records and buildings (in a new shell first: source $(BIN)/activate, then per-obspy without its path):"
	@echo "     $(BIN)/per-obspy run RECORDS PAIRS -o output/mine"

# The figures of the README are those of the demonstration
figures: demo
	@echo "== redraw the paper's figures, on real records if PER_OBSPY_DATA or ../shared/data has them"
	$(BIN)/python workflows/paper_figures.py
	@echo "== redraw the figures of the README"
	$(BIN)/python workflows/readme_figures.py

# Tests on all processors; those of Snakemake are `make workflows`
PYTEST := $(BIN)/python -m pytest -q -n auto --dist worksteal --ignore tests/workflows/test_snakefile.py

test: .venv/test
	@echo "== tests and doctests; make test-long and make workflows have the rest"
	$(PYTEST) -m "not long"
	@echo "== the kernels' tests once more without the compiler, where an index out of bounds is an error"
	NUMBA_DISABLE_JIT=1 $(PYTEST) -m "not compiled" tests/kernels

test-long: .venv/test
	@echo "== damaged copies of every format, killed runs and watchers, whole earthquakes, the blocks of README and docs"
	$(PYTEST) -m long tests

workflows: .venv/test .venv/workflows
	@echo "== two scenarios and their ensemble by Snakemake, killed and resumed"
	$(BIN)/python -m pytest -q tests/workflows/test_snakefile.py

rehearsal: .venv/test
	@echo "== an earthquake that happens: failing services, late stations, killed processes"
	$(BIN)/python workflows/rehearsal.py

check: .venv/check
	$(BIN)/python tests/check_density.py
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: .venv/docs
	@echo "== build the documentation in output/docs, offline; a warning or a link to nowhere is an error"
	rm -rf output/docs docs/generated
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -W ignore -m sphinx -q -W --keep-going -b html docs output/docs
	$(BIN)/python docs/extensions/check_site.py output/docs

wheel: .venv/check
	@echo "== build the wheel, install it into an empty environment, use it in an empty folder, check its types"
	rm -rf dist .venv/wheel
	$(BIN)/python -m build --outdir dist . >/dev/null
	PYTHON=$(PYTHON) EXTRAS= workflows/container/install.sh install "$$(ls dist/*.whl)" .venv/wheel
	folder=$$(mktemp -d) && cp workflows/smoke.py $$folder && cd $$folder && $(CURDIR)/.venv/wheel/bin/python smoke.py && \
	  $(CURDIR)/.venv/bin/mypy --strict --config-file= --python-executable $(CURDIR)/.venv/wheel/bin/python smoke.py
	@echo "== the other steps of the container, but for the compilation"
	WARM_UP=no workflows/container/install.sh compile .venv/wheel
	workflows/container/install.sh check .venv/wheel

benchmark: .venv/benchmark
	$(BIN)/python tests/benchmarks/figures.py docs/benchmarks.json
	@if [ -z "$(RECORDS)" ]; then echo "== processing: left out, name a folder of MiniSEED with RECORDS=..."; \
	  else echo "== processing"; OPENBLAS_NUM_THREADS=1 $(BIN)/python tests/benchmarks/processing.py "$(RECORDS)"; fi

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "per_obspy needs Python 3.11 or newer; name one with PYTHON=..."; exit 1; }
	@echo "== make a virtual environment in .venv"
	$(PYTHON) -m venv .venv

.venv/run: .venv/bin/python pyproject.toml
	@echo "== install per_obspy and what it needs (about a minute)"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@echo "== compile the kernels (once, one to two minutes)"
	$(BIN)/per-obspy warm-up
	@touch $@

# All at once, which takes less time than one after the other
EXTRAS := check docs test workflows
extras: .venv/run
	@echo "== install what $(EXTRAS) need"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[check,docs,test,workflows]'
	@touch $(EXTRAS:%=.venv/%)

constraints: extras
	@echo "== write the versions of this environment for container and CI, after a whole test"
	$(BIN)/python workflows/container/constraints.py > workflows/container/constraints.part
	mv workflows/container/constraints.part workflows/container/constraints.txt

.venv/%: .venv/run
	@echo "== install what '$*' needs"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$*]'
	@touch $@

clean:
	rm -rf .venv dist output docs/generated
