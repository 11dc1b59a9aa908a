# make design   sets everything up and designs the gains of the shipped vehicle
# make test     sets everything up and runs the fast tests
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready

.PHONY: design test slow bench guide picture lint lock wheel clean
design: $(READY)
	$(BIN)/workbench design revenue_vehicle --out results/revenue_vehicle

test: $(READY)
	$(BIN)/pytest -n 2 -m "not slow"

slow: $(READY)
	$(BIN)/pytest -n 2 -m slow

bench: $(READY)
	$(BIN)/python -m tests.bench

guide: $(READY)
	$(BIN)/sphinx-build -W --keep-going -q -b html notebooks/guide results/guide

# the house as ARCHITECTURE.md shows it
picture: $(READY)
	$(BIN)/python notebooks/pictures/house.py

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

# The lock names packages and their hashes, never a registry; pip finds them wherever it is configured to look.
$(READY): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; set PYTHON=/path/to/python3.11")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@

lock:
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/uv pip compile --universal --python-version 3.11 --group dev --all-extras --generate-hashes \
		--no-emit-index-url --no-annotate --no-emit-package maglev-workbench --no-header \
		--quiet -o requirements.lock pyproject.toml

wheel: $(READY)
	$(BIN)/python -m pip wheel --no-deps --no-build-isolation -w dist .

clean:
	rm -rf .venv dist build results
