# FogSim: `make demo` and `make test` need nothing but Python ≥ 3.11 and the system libraries that `make check` names.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Packages are installed without bytecode, and it is written as modules are used: also where the environment forbids it,
# as containers do. Otherwise each of the tests' hundred processes would compile all that it imports anew.
export PYTHONDONTWRITEBYTECODE :=

# Install FogSim with EXTRAS. uv takes seconds where pip takes a minute; where uv cannot be had, or does not reach the
# packages that pip is told of, pip does it.
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check uv \
	&& $(BIN)/uv pip install --quiet --no-cache --python $(BIN)/python --editable '.$(EXTRAS)' \
	|| { echo "uv could not, so pip installs …"; \
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --use-pep517 --editable '.$(EXTRAS)'; }

.DEFAULT_GOAL := help
.PHONY: help check demo test affected nightly hooks portability cluster notebooks site browse wheel pythons release lint types contracts ci tables clean

help: ## Show what can be made
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

check: ## Say in one line what the system lacks, if anything
	@command -v $(PYTHON) >/dev/null || { echo "FogSim needs Python 3.11 or newer: sudo apt-get install python3 python3-venv"; exit 1; }
	@$(PYTHON) tools/check_system.py

# That of continuous integration includes all others, so that they are not installed one after another.
INSTALLED := $(addprefix $(VENV)/.installed,-test -cluster -notebooks -docs)
$(VENV)/.installed: EXTRAS :=
$(VENV)/.installed-test: EXTRAS := [test]
$(VENV)/.installed-cluster: EXTRAS := [test,ray]
$(VENV)/.installed-notebooks: EXTRAS := [notebooks]
$(VENV)/.installed-docs: EXTRAS := [docs,notebooks]
$(VENV)/.installed-ci: EXTRAS := [test,notebooks,docs,ray]
$(VENV)/.installed-ci: INCLUDED := $(INSTALLED)
$(filter-out %-test,$(INSTALLED)): $(VENV)/.installed-test
$(VENV)/.installed $(INSTALLED) $(VENV)/.installed-ci: pyproject.toml | check
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@echo "Installing FogSim$(EXTRAS) into $(VENV) (once, a minute or two) …"
	@$(INSTALL)
	@touch $(VENV)/.installed $(INCLUDED) $@

$(VENV)/.compiled: $(VENV)/.installed-test
	@echo "Compiling kernels (once, a minute or two) …"
	@$(BIN)/fogsim compile
	@touch $@

demo: $(VENV)/.installed ## Run the demo scenario; results go to runs/demo/
	@$(BIN)/fogsim run motorway_fog_bank --seed 1 --out runs/demo --overwrite

# Otherwise glibc returns the memory of images after each operation on them and requests it again page by page: a tenth
# of the time of tests that draw. Other C libraries do not know these names.
test affected nightly: export MALLOC_MMAP_THRESHOLD_ := 1000000000
test affected nightly: export MALLOC_TRIM_THRESHOLD_ := 2000000000
# There is a process of pytest for each processor: threads of OpenBLAS in each would take turns waiting in a loop. A
# product of matrices of 240×240 takes 0.6 ms of processor time with one thread, and up to 13 ms with two on a busy machine.
test affected nightly: export OPENBLAS_NUM_THREADS := 1
PYTEST = $(BIN)/python -m pytest -n auto --dist worksteal

test: $(VENV)/.installed-test $(VENV)/.compiled ## Run the test suite, except what has its own command and what is nightly
	@$(PYTEST) -m "not nightly"

affected: $(VENV)/.installed-test $(VENV)/.compiled ## Run the tests that changes since the branch left main can touch; REF=HEAD~1: since that commit
	@tests="$$($(BIN)/python tools/affected.py $(REF))"; \
	if [ -z "$$tests" ]; then echo "No test can be touched."; else $(PYTEST) -m "not nightly" $$tests; fi

nightly: $(VENV)/.installed-test $(VENV)/.compiled ## Run the tests that take minutes: before a release
	@$(PYTEST) -m nightly
	@$(BIN)/fogsim test scenarios
	@$(MAKE) portability pythons

hooks: $(VENV)/.installed-test ## Check style, types and contracts before each commit
	@$(BIN)/pre-commit install

portability: $(VENV)/.installed-test ## Check that other processors' kernels change nothing (compiles all anew)
	@$(BIN)/python -m pytest tests/portability

cluster: $(VENV)/.installed-cluster ## Run a study on a Ray cluster of two nodes, and kill one (installs Ray)
	@$(BIN)/python -m pytest tests/cluster

notebooks: $(VENV)/.installed-notebooks ## Run the notebooks from their first cell to their last
	@$(BIN)/python -m pytest -q -n auto tests/notebooks

site: export NO_MKDOCS_2_WARNING := 1
site: $(VENV)/.installed-docs $(VENV)/.compiled ## Build the documentation site into site/; runs the notebooks (some minutes) if code has changed
	@$(BIN)/mkdocs build --quiet
	@echo "site/index.html"

browse: $(VENV)/.installed-docs ## Build the site and look at it in a headless browser, without changing site/
	@$(BIN)/python -m pytest -q tests/site

wheel: export HATCH_BUILD_HOOK_ENABLE_CUSTOM := true
wheel: $(VENV)/.installed-test ## Build sdist and wheel into dist/, the wheel with kernels compiled: its first run compiles none
	@$(BIN)/python -m build --no-isolation --outdir dist

pythons: $(VENV)/.installed-test ## Install the wheel into an empty environment of each Python 3.11 to 3.13 that is here, and run it
	@$(BIN)/python -m pytest -q tests/pythons

# Whatever fails ends it before the sums are written: without them there is nothing to be uploaded.
release: $(VENV)/.installed-test ## Build sdist and wheels into dist/, check them in each Python, write SHA256SUMS; refuses outdated tables
	@test -z "$$(git status --porcelain)" || { echo "Commit or remove what 'git status' lists: a release is of a commit."; exit 1; }
	@$(BIN)/python docs/rerun_tables.py --current || { echo "Measure them again: make tables, and make tables STUDIES=1"; exit 1; }
	@rm -rf dist
	@$(BIN)/python -m build --sdist --no-isolation --outdir dist
	@WHEELS="$(CURDIR)/dist" $(BIN)/python -m pytest -q -rs tests/pythons
	@cd dist && sha256sum * > SHA256SUMS && cat SHA256SUMS

lint: $(VENV)/.installed-test ## Check style
	@$(BIN)/ruff check . && $(BIN)/ruff format --check . && $(BIN)/python tools/check_docstrings.py

types: $(VENV)/.installed-test ## Check types
	@$(BIN)/mypy

contracts: $(VENV)/.installed-test ## Check which stage may import which
	@$(BIN)/lint-imports

# What works on one processor, or waits, goes beside something else; the tests themselves take all processors.
ci: $(VENV)/.installed-ci ## Everything that .ci/run checks
	@$(MAKE) --jobs=2 --output-sync=target types lint contracts $(VENV)/.compiled
	@$(MAKE) test
	@$(MAKE) notebooks
	@$(MAKE) --jobs=2 --output-sync=target browse cluster

tables: $(VENV)/.installed-test ## Measure the docs' tables whose code has changed (resumable); STUDIES=1: policy studies; TABLES="belief …"
	@$(BIN)/python docs/rerun_tables.py $(TABLES) $(if $(STUDIES),--studies)

clean: ## Remove the environment, results and caches
	rm -rf $(VENV) runs dist build site .cache .mypy_cache .ruff_cache .pytest_cache
