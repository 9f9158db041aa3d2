# Common tasks. `make` without arguments prints this list.
.DEFAULT_GOAL := help
.PHONY: help fmt lint test test-slow valgrind doc bench paper stress fuzz mutants doctor ci

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

fmt: ## format all sources
	./scripts/format

lint: ## check format and lints, warnings as errors
	./scripts/format --check
	cargo clippy --workspace --all-targets --locked -- -D warnings

test: ## set up the machine if necessary, then run all quick tests
	./scripts/test

test-slow: ## the slow tests, in release mode, the wrapper with SUNDIALS 7.1.1, and the benchmarks of other solvers
	cargo test --workspace --locked --release -- --ignored
	cargo test --workspace --locked --features vendored --test wrapper
	cargo check --manifest-path bench/rivals/Cargo.toml --bins --benches --locked
	cargo build --release --locked -p myovib && ./scripts/slurm

valgrind: ## small tests of sundials-wrap, radau and model under valgrind
	./scripts/valgrind

doc: ## API documentation in target/doc, warnings as errors
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

bench: ## timings; writes a dated record to data/bench
	./scripts/bench

paper: ## compare Table 2 of the paper with our results
	./scripts/reproduce

stress: ## accuracy over all formulations, κ, β, loads and tolerances (hours; continues after an interruption)
	./scripts/stress

fuzz: ## fuzz each input parser for ten minutes (nightly and cargo-fuzz; otherwise seeded mutants)
	./scripts/fuzz

mutants: ## mutation testing of a seeded sample (hours; requires cargo-mutants)
	./scripts/mutants

doctor: ## report library versions and missing dependencies
	cargo run --release --locked --quiet -p myovib -- doctor

ci: ## run all checks of the gate
	./.ci/run
