# Two commands matter: `make run` serves the product, `make test` tests it. Both set up what they need.
.DEFAULT_GOAL := help
.PHONY: help setup setup-experiments wheels setup-tests run test check contracts demo-human demo-offline bench migration clean

bin := .venv/bin
# One file's tests stay in one process, since they share servers and trained runs.
pytest := $(bin)/pytest --numprocesses auto --dist loadfile

help: ## List these commands
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 24

setup: ## Make .venv and install what the product needs
	@scripts/setup product

setup-experiments: ## Make .venv for experiments with scripted teachers alone: PYTORCH=system WHEELS=wheels
	@scripts/setup experiments

wheels: setup ## Fetch what experiments need for a machine without a package index: make wheels PYTHON_THERE=3.12
	@$(bin)/python scripts/fetch_wheels.py $(if $(PYTHON_THERE),--python $(PYTHON_THERE)) wheels

setup-tests:
	@scripts/setup tests

run: setup ## Serve the product at http://127.0.0.1:8000
	@$(bin)/pebble up || [ $$? -eq 130 ] # Ctrl-C is the usual end

test: setup-tests ## Run every test but the demonstrations and the slow contracts
	@$(pytest)

check: setup-tests ## Format, lint, types, tests: what must pass before a change lands
	@$(bin)/ruff format --check .
	@$(bin)/ruff check .
	@$(bin)/mypy
	@$(MAKE) --no-print-directory test

contracts: setup-tests ## Run what every agent, environment, teacher and scheme must hold
	@$(pytest) -m contracts

demo-human: setup-tests ## Teach a cart pole through the browser, from the form to the windmill
	@$(bin)/pytest -m demo tests/web

demo-offline: setup-tests ## Install and run an experiment as on a machine that has PyTorch and no network
	@$(bin)/pytest -m demo tests/setup

peers := build/peers
$(peers)/installed: benchmarks/speed/peers.txt
	@python3 -m venv $(peers)
	@$(peers)/bin/python -m pip install -q --disable-pip-version-check -r $<
	@touch $@

bench: setup-tests $(peers)/installed ## Measure every step of the loop beside its best peers (15 minutes, nothing else running)
	@$(bin)/python -m benchmarks.speed --peers $(peers)/bin/python

migration: setup-tests ## Write the migration to today's tables: make migration NAME="what changes"
	@$(bin)/python scripts/make_migration.py "$(NAME)"

clean: ## Remove .venv and caches; data/ stays
	rm -rf .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis test-results
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
