# Commands for a fresh machine with Python >= 3.10, make and a package index:
#   make walk   walks ten seconds and says where the replay and the report are
#   make quick  after a change: the tests that take no time
#   make test   everything that can fail: style, types, tests, and how many lines they cover
#   make docs   the documentation site, in build/docs, with every notebook run
#   make dist   the package: built, checked, and tried from another folder
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Small matrices: more than one BLAS thread only gets in the way.
export OPENBLAS_NUM_THREADS := 1
# The demonstration writes to the same place every time.
WALK := runs/walking

.PHONY: help install walk quick test lint types pytest docs dist compare clean

help:
	@sed -n '2,6s/^#  *//p' Makefile

install: $(VENV)/installed

$(VENV)/installed: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "Python >= 3.10 is needed and $(PYTHON) is older; choose another one with make PYTHON=..."; exit 1; }
	@$(PYTHON) -m venv $(VENV) || \
	  { echo "$(PYTHON) cannot make a virtual environment; on Debian and Ubuntu: apt-get install python3-venv"; exit 1; }
	@echo "installing into $(VENV), which takes a minute"
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[test,dev,campaign,docs]"
	@touch $@

walk: install
	$(BIN)/pdhocbf run walking --out $(WALK)
	@echo "for the command pdhocbf in this terminal: . $(BIN)/activate"

test: lint types pytest

lint: install
	$(BIN)/ruff check .
	$(BIN)/lint-imports --no-cache --no-logo
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/ci.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(BIN)/pre-commit validate-config
types: install
	$(BIN)/mypy

# On all cores, in the order of tests/conftest.py; the tests of one file share what they build. Lines of kernels are
# counted with the compiler off.
PYTEST := $(BIN)/python -m pytest -n logical --dist loadfile --no-loadscope-reorder
KERNELS := tests/test_*_kernels.py tests/test_gait.py tests/test_push_swing.py

quick: install
	$(PYTEST) -m "not slow"
pytest: install
	NUMBA_DISABLE_JIT=1 $(PYTEST) --cov --cov-report= --cov-fail-under=0 -k "not every_kernel" $(KERNELS)
	$(PYTEST) --cov --cov-append

# Four processes share the pages, of which notebooks take longest; a following `make test` looks at what they ran. Every warning is an error, and nothing is loaded from
# a network. PATH has the commands whose help the pages show.
docs: install
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/python -m sphinx -j 4 --quiet --fail-on-warning --keep-going -c docs . build/docs
	@echo "open build/docs/index.html"

# The wheel walks from any folder: unpacked without the checkout, and run with what is installed here.
dist: install
	rm -rf dist runs/wheel
	$(BIN)/python -m build --no-isolation
	$(BIN)/twine check --strict dist/*
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --target runs/wheel dist/*.whl
	cd runs/wheel && PYTHONPATH=. $(abspath $(BIN))/python bin/pdhocbf run walking --text 'duration: 2.0' --no-replay

# Against an earlier commit: make compare REV=1d95bb6, and to see only half of it, ARGS="--only scenarios".
compare: install
	@test -n "$(REV)" || { echo "say which commit to compare with: make compare REV=..."; exit 1; }
	$(BIN)/python benchmarks/compare.py $(REV) $(ARGS)

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache
