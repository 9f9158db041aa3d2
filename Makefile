# The menu of habits. `make` alone prints it.
.DEFAULT_GOAL := help
.PHONY: help fmt lint test test-slow valgrind doc bench paper stress fuzz mutants doctor ci

help: ## print this menu
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

fmt: ## format all sources
	./scripts/format

lint: ## format and lints, warnings as errors
	./scripts/format --check
	cargo clippy --workspace --all-targets --locked -- -D warnings

test: ## set up the machine if needed, then all quick tests
	./scripts/test

test-slow: ## the slow tests, in release mode
	cargo test --workspace --locked --release -- --ignored
	cargo build --release --locked -p myovib && ./scripts/slurm

valgrind: ## small tests of wrapper, Radau IIA and model under valgrind
	./scripts/valgrind

doc: ## the documentation, warnings as errors; opens at target/doc/myovib_model
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

bench: ## timings; a dated record goes to data/bench
	./scripts/bench

paper: ## Table 2 of the paper beside ours
	./scripts/reproduce

stress: ## all planes of the stress matrix (hours; goes on where it was interrupted)
	cargo run --release --locked --quiet -p myovib-bench -- stress --full --out out/stress

fuzz: ## ten minutes for each reader of input (nightly and cargo-fuzz; without: seeded mutants)
	./scripts/fuzz

mutants: ## mutation testing of a seeded sample (hours; cargo-mutants)
	./scripts/mutants

doctor: ## what this machine has, what it lacks
	cargo run --release --locked --quiet -p myovib -- doctor

ci: ## what the gate runs
	./.ci/run
