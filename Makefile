# The menu of habits. `make` alone prints it.
.DEFAULT_GOAL := help
.PHONY: help fmt lint test test-slow doc bench paper doctor ci

help: ## print this menu
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

fmt: ## format all sources
	cargo fmt --all

lint: ## format and lints, warnings as errors
	cargo fmt --all -- --check
	cargo clippy --workspace --all-targets --locked -- -D warnings

test: ## set up the machine if needed, then all quick tests
	./scripts/test

test-slow: ## the slow tests, in release mode
	cargo test --workspace --locked --release -- --ignored

doc: ## the documentation, warnings as errors; opens at target/doc/myovib_model
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked

bench: ## timings
	cargo bench --workspace --locked

paper: ## Table 2 of the paper beside ours
	./scripts/reproduce

doctor: ## what this machine has, what it lacks
	cargo run --release --locked --quiet -p myovib -- doctor

ci: ## what the gate runs
	./.ci/run
