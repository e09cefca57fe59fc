# Every target sets up by itself; ARGS="..." is handed on to the tool.
SHELL := bash
BIN := .venv/bin
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
# On two cores: a test that waits for a browser leaves one idle.
WORKERS := 3
# Many tests start a Python of their own: what is compiled once is kept, whatever the environment says.
# The app's fits give way to all else: beside tests of usual priority they would starve.
PYTEST := $(ONE_THREAD) PYTHONDONTWRITEBYTECODE= nice -n 19 $(BIN)/python -m pytest -n $(WORKERS) --dist worksteal -rs

.PHONY: help setup demo test test-slow lint format docs bench bench-faults bench-hidden bench-truth lock clean setup-benchmark

help:
	@echo "make setup   .venv with the locked versions"
	@echo "make demo    make the demo subject, fit it, open the app"
	@echo "make test    the tests            make test-slow   those that take long"
	@echo "make lint    ruff, import-linter, mypy"
	@echo "make docs    the documentation as a site, in build/site; links checked"
	@echo "make setup-benchmark   PyTorch for the benchmark's learnt predictors"
	@echo "make bench   speed and accuracy   make format  ruff's formatter"
	@echo "make bench-faults      known faults edited into real recordings: right, wrong, missed; FAULTS_OUT, SEED, TIMES"
	@echo "make bench-hidden      hidden effects: named, missed, falsely alarmed, beside ordinary methods; CASES, HIDDEN_OUT"
	@echo "make bench-truth       fits against known and experts' motions; TRUTH_OUT"

setup: .venv/installed

.venv/installed: pyproject.toml requirements.lock requirements-opensim.lock scripts/setup
	@scripts/setup

# PyTorch, for the benchmark's learnt predictors. PyPI's Linux wheels bring gigabytes of CUDA; a CPU build of that version will do too.
setup-benchmark: setup
	$(BIN)/python -m pip install --quiet -r requirements-benchmark.lock

demo: setup
	$(BIN)/addb-viewer demo $(ARGS)

test: setup
	@scripts/chromium
	$(PYTEST) -m "not slow" $(ARGS)

test-slow: setup
	@scripts/chromium
	$(PYTEST) -m slow $(ARGS)

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	printf '%s\n' linux win32 | xargs -P 2 -I SYSTEM $(BIN)/mypy --platform SYSTEM --cache-dir .mypy_cache/SYSTEM
	@$(BIN)/python scripts/structure.py

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: .venv/docs-installed
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "build/site/index.html"

.venv/docs-installed: .venv/installed requirements-docs.lock
	$(BIN)/python -m pip install --disable-pip-version-check --quiet -r requirements-docs.lock
	@touch $@

bench: setup
	$(ONE_THREAD) $(BIN)/python -m benchmarks $(ARGS)

# Picks up where it was stopped, as long as FAULTS_OUT is the same.
FAULTS_OUT := $(CURDIR)/build/faults
bench-faults: setup
	$(ONE_THREAD) $(BIN)/python -m benchmarks.faults make --out $(FAULTS_OUT) $(if $(SEED),--seed $(SEED)) \
	  $(if $(TIMES),--times $(TIMES))
	$(ONE_THREAD) $(BIN)/python -m benchmarks.faults run --out $(FAULTS_OUT) $(ARGS)
	$(ONE_THREAD) $(BIN)/python -m benchmarks.faults score --out $(FAULTS_OUT) --page benchmarks/FAULTS.md

# Picks up where it was stopped. Whoever publishes the cases keeps HIDDEN_OUT/truth to themselves.
HIDDEN_OUT := $(CURDIR)/build/hidden
HIDDEN_SEED := 1
CASES := 300
bench-hidden: setup
	$(ONE_THREAD) $(BIN)/python -m benchmarks.hidden make --out $(HIDDEN_OUT)/cases --truth $(HIDDEN_OUT)/truth \
	  --cases $(CASES) --seed $(HIDDEN_SEED)
	$(ONE_THREAD) $(BIN)/python -m benchmarks.hidden run --out $(HIDDEN_OUT)/cases --results $(HIDDEN_OUT)/results $(ARGS)
	$(ONE_THREAD) $(BIN)/python -m benchmarks.hidden page --out $(HIDDEN_OUT)/cases --truth $(HIDDEN_OUT)/truth \
	  --results $(HIDDEN_OUT)/results --page benchmarks/HIDDEN.md

# Picks up where it was stopped; a change of the solver makes all figures anew.
TRUTH_OUT := $(CURDIR)/build/truth
bench-truth: setup
	$(ONE_THREAD) $(BIN)/python -m benchmarks.truth --out $(TRUTH_OUT) --workers 2 \
	  --page benchmarks/TRUTH.md $(ARGS)

# Needs uv on PATH. One set of versions for Python 3.11 to 3.13; OpenSim apart, since not every platform has its wheel,
# and what only the documentation's site needs.
COMPILE := uv pip compile --quiet --universal --python-version 3.11 --fork-strategy fewest \
  --no-emit-index-url --no-header --no-annotate pyproject.toml --output-file requirements.all
lock:
	$(COMPILE) --extra dev --extra dataset --extra reference
	grep '^opensim==' requirements.all > requirements-opensim.lock
	grep -v '^opensim==' requirements.all > requirements.lock
	rm requirements.all
	$(COMPILE) --extra docs --constraints requirements.lock
	grep -vxFf requirements.lock requirements.all > requirements-docs.lock
	$(COMPILE) --extra benchmark --constraints requirements.lock
	grep -vxFf requirements.lock requirements.all | grep -v '^\(nvidia-\|cuda-\|triton\)' > requirements-benchmark.lock
	rm requirements.all

clean:
	rm -rf .venv demo
