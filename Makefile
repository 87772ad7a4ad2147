# How to build, test and measure ntagen. It needs Python 3.11 or newer and a C tool chain; if there is no cargo, it is
# downloaded. You need not activate anything: everything runs in .venv, which is made on first use and kept up to date.

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help

PYTHON ?= $(firstword $(foreach name,python3 python3.14 python3.13 python3.12 python3.11,\
	$(shell $(name) -c 'import sys; sys.version_info >= (3, 11) and print("$(name)")' 2>/dev/null)) python3)
BIN := .venv/bin
# A shell script that finds cargo: empty, or with the path of the downloaded tool chain.
RUST := .venv/rust.sh
# The packages for development, with versions and hashes; users can have all versions that pyproject.toml allows.
LOCK := requirements-dev.lock
PACKAGES := .venv/packages
INSTALLED := .venv/installed
# The sources of the installed engine. Python files and templates are used in place.
ENGINE := pyproject.toml checker/Cargo.toml checker/Cargo.lock $(shell find checker/src checker/pages -name '*.rs' -o -name '*.md')

.PHONY: help
help: ## Show these targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 18

.PHONY: setup
setup: $(INSTALLED) ## Create .venv with ntagen and its tools in it (the first time takes minutes)

.PHONY: demo
demo: $(INSTALLED) ## Run the main job on the paper's environment; results in demo/
	@mkdir -p demo
	$(BIN)/ntagen compile examples/paper.nsl -o demo
	$(BIN)/ntagen check examples/paper.nsl --plans demo/plans.json
	$(BIN)/ntagen plot examples/paper.nsl -o demo/scene.png --plans 10
	$(BIN)/ntagen drive examples/paper.nsl --needle grbl+sim --seed 1 --log demo/run.mcap
	@printf '%s\n' '' \
	  'What happened: the environment was turned into a UPPAAL model. Both queries of the paper were checked on it.' \
	  'All plans were ranked. A phantom needle was steered to the target through an emulated stepper controller.' \
	  'Where to look:' \
	  '  demo/paper.xml   the model; UPPAAL opens it, with the queries in its verifier' \
	  '  demo/plans.json  all plans with their clearance from the critical regions, best first' \
	  '  demo/scene.png   the scene and the ten best plans' \
	  '  demo/run.mcap    the run; see it with `$(BIN)/ntagen replay demo/run.mcap`, or in Foxglove'

.PHONY: experiments
experiments: $(INSTALLED) ## Make the paper's three experiments with few seeds (some minutes); tables and reports in demo/experiments/
	@rm -rf demo/experiments
	@mkdir -p demo/experiments/traces
	@for kind in arc drift one_roll two_rolls irregular; do \
	  $(BIN)/python examples/traces/make_trace.py $$kind --seed 1 > demo/experiments/traces/$$kind.csv; done
	$(BIN)/ntagen match examples/traces/bench.nsl demo/experiments/traces/*.csv -o demo/experiments/match.png \
	  | tee demo/experiments/match.txt
	$(BIN)/ntagen experiment examples/experiments/virtual.toml --runs 5 -o demo/experiments/virtual
	$(BIN)/ntagen experiment examples/experiments/real.toml --runs 1 -o demo/experiments/real
	$(BIN)/ntagen sweep examples/experiments/scenes/surface_crs.nsl --over delay --values 0,0.2,0.5,1s --runs 4 \
	  -o demo/experiments/delay

.PHONY: test
test: $(INSTALLED) ## Run all tests, Rust and Python
	source $(RUST) && cd checker && cargo test --locked --quiet
	source $(RUST) && $(BIN)/python -m pytest --numprocesses=auto --dist=worksteal

.PHONY: quick
quick: $(INSTALLED) ## Run the tests of single modules that take at most a second or so each, Rust and Python side by side
	@$(MAKE) --no-print-directory --jobs=2 --output-sync=target quick-rust quick-python

.PHONY: quick-rust
quick-rust: $(RUST)
	source $(RUST) && cd checker && cargo test --locked --quiet --lib --test language --test architecture

.PHONY: quick-python
quick-python: $(INSTALLED)
	$(BIN)/python -m pytest tests/unit tests/test_*.py -m 'not slow' --hypothesis-profile=quick --numprocesses=auto --dist=worksteal

# The tests of the engine, built and not run: a second core builds them beside the installed engine.
.PHONY: build-tests
build-tests: $(RUST)
	source $(RUST) && cd checker && cargo test --locked --quiet --no-run

.PHONY: lint
lint: lint-rust lint-python ## Check formats, lints and types

.PHONY: lint-python
lint-python: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest ntagen._checker

.PHONY: lint-rust
lint-rust: $(RUST)
	source $(RUST) && cd checker && cargo fmt --check
	source $(RUST) && cd checker && cargo clippy --locked --all-targets --features python --quiet -- -D warnings

.PHONY: docs
docs: $(INSTALLED) ## Make the documentation site in build/docs; begin with build/docs/index.html
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet docs build/docs

.PHONY: format
format: $(INSTALLED) ## Format all sources, and fix what the linter can fix
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	source $(RUST) && cd checker && cargo fmt

.PHONY: lock
lock: | .venv ## Update requirements-dev.lock to the newest versions that pyproject.toml allows
	$(BIN)/python -m pip install --quiet uv
	$(BIN)/python -m uv pip compile --quiet --universal --python-version 3.11 --upgrade --extra dev --generate-hashes \
	  --no-annotate --no-emit-index-url --custom-compile-command 'make lock' --output-file $(LOCK) pyproject.toml

.PHONY: bundle
bundle: ## Build the library of the page that edits models, from editors/bundle (needs node and npm)
	cd editors/bundle && npm ci --ignore-scripts --no-audit --no-fund && node build.mjs

.PHONY: picture
picture: $(INSTALLED) ## Draw examples/scene.png, the picture in the README
	$(BIN)/ntagen plot examples/paper.nsl -o examples/scene.png --plans 10

.PHONY: bench
bench: $(INSTALLED) ## Measure the engine (plans, syntheses, reductions, deadlocks, state spaces, code, loading, zones) and trackers
	$(BIN)/python tests/benchmarks/needle.py
	$(BIN)/python tests/benchmarks/syntheses.py
	$(BIN)/python tests/benchmarks/rounding.py
	$(BIN)/python tests/benchmarks/spinning.py --drives 0
	$(BIN)/python tests/benchmarks/many_regions.py
	$(BIN)/python tests/benchmarks/moving.py
	$(BIN)/python tests/benchmarks/fields.py
	$(BIN)/python tests/benchmarks/plan_list.py
	$(BIN)/python tests/benchmarks/tables.py
	$(BIN)/python tests/benchmarks/start.py
	$(BIN)/python tests/benchmarks/reductions.py
	$(BIN)/python tests/benchmarks/deadlocks.py
	$(BIN)/python tests/benchmarks/machines.py
	$(BIN)/python tests/benchmarks/tracker.py
	$(BIN)/python tests/benchmarks/race.py
	$(BIN)/python tests/benchmarks/race.py --threads 2 "fischer 10" "csmacd 11" peterson
	source $(RUST) && cd checker && NTAGEN=../$(BIN)/ntagen cargo bench --locked

.PHONY: bench-needle
bench-needle: $(INSTALLED) ## Measure the phantom needle against real ones, what the estimator predicts, and how drives of both needles end
	$(BIN)/python tests/benchmarks/phantom.py
	$(BIN)/python tests/benchmarks/predictions.py
	$(BIN)/python -m tests.benchmarks.filters --grid --brief
	$(BIN)/python -m tests.benchmarks.matching
	$(BIN)/python tests/benchmarks/drives.py --noise 0.1 1 2 --least 0.93
	$(BIN)/python tests/benchmarks/drives.py --needle phantom --seeds 100 --known all none

.PHONY: bench-experiments
bench-experiments: $(INSTALLED) ## Measure how many runs of a campaign are made in a second, and what it costs beside them
	$(BIN)/python tests/benchmarks/experiment.py
	$(BIN)/python tests/benchmarks/experiment.py --dask

.PHONY: bench-devices
bench-devices: $(INSTALLED) ## Measure how fast a stop is on the wire, and whether runs with faults at random moments end well
	$(BIN)/python tests/benchmarks/stop.py
	$(BIN)/python -m tests.benchmarks.faults
	$(BIN)/python -m tests.benchmarks.lab_faults
	$(BIN)/python -m tests.benchmarks.cuts

.PHONY: bench-limits
bench-limits: $(INSTALLED) ## Measure whether the time and memory limits hold: 20 models with up to 250 clocks
	$(BIN)/python tests/benchmarks/limits.py

.PHONY: bench-games
bench-games: $(INSTALLED) ## Measure how far the solver of games gets (seven families, up to 60 s or 4 GiB), and what checking strategies costs
	$(BIN)/python tests/benchmarks/games.py
	$(BIN)/python tests/benchmarks/verified.py

.PHONY: ablation
ablation: $(INSTALLED) ## Measure what each heuristic of the engine gains (about 20 minutes; MODELS=FOLDER adds models)
	$(BIN)/python tests/benchmarks/ablation.py $(if $(MODELS),--models $(MODELS))

.PHONY: clean
clean: ## Remove everything that was built, also .venv
	rm -rf .venv build dist demo checker/target ntagen/_checker*.so
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find ntagen tests -name __pycache__ -type d -prune -exec rm -rf {} +

# The build uses the maturin in .venv, not the newest version.
$(INSTALLED): $(RUST) $(ENGINE) | $(PACKAGES)
	source $(RUST) && PATH="$(CURDIR)/$(BIN):$$PATH" \
	  $(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(PACKAGES): $(LOCK) | .venv
	$(BIN)/python -m pip install --quiet --require-hashes --requirement $(LOCK)
	@touch $@

$(RUST): | $(PACKAGES)
	@if ! command -v cargo >/dev/null; then \
	  echo 'There is no cargo on the PATH: downloading a Rust tool chain into the cache.'; \
	  $(BIN)/python -m puccinialin --program ntagen --info-json .venv/rust.json >/dev/null; \
	  $(BIN)/python -c 'import json, shlex; \
	    [print(f"export {k}={shlex.quote(v)}") for k, v in json.load(open(".venv/rust.json"))["env"].items()]' > $@.part; \
	else : > $@.part; fi
	@source $@.part && { { cargo fmt --version && cargo clippy --version; } >/dev/null 2>&1 || rustup component add rustfmt clippy || \
	  echo 'cargo fmt and cargo clippy are missing: `make lint` needs them.'; }
	@mv $@.part $@

.venv:
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("ntagen needs Python 3.11 or newer; set PYTHON=…")'
	$(PYTHON) -m venv $@
