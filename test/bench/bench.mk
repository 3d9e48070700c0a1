# bench.mk -- brume against other renderers. Included by the Makefile.

.PHONY: bench bench-peers bench-traversal bench-quick bench-growth check-bench

bench-peers:
	@sh lib/deps.sh python3 python3-venv libllvm19 || echo "bench-peers: no libllvm19: Mitsuba is scalar"
	python3 test/bench/bench.py $(build) --install

# A quarter of an hour once its references are rendered; build/bench/venv/bin/python test/bench/bench.py --help
bench: all $(build)/test/bench/worker build/meshes/ball.ply
	@python3 test/bench/bench.py $(build) $(ARGS)

# On one core. ARGS=11: rounds
bench-traversal:
	@sh lib/deps.sh libembree-dev
	@$(MAKE) --no-print-directory $(build)/test/bench/traversal
	@mkdir -p out/bench
	POCL_MAX_PTHREAD_COUNT=1 taskset -c 0 $(build)/test/bench/traversal out/bench/traversal.json $(ARGS)

$(build)/test/bench/traversal: $(patsubst %,$(build)/test/bench/%.o,traversal traversal_meshes) $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $^ -lembree3 $(libs)

# This tree against an earlier commit, a minute: make bench-quick BASE=main~10
bench-quick: all build/meshes/ball.ply
	@test -n "$(BASE)" || { echo "bench-quick: which commit? BASE=main~10" >&2; exit 2; }
	@python3 test/bench/bench_quick.py $(build) $(BASE) $(ARGS)

# ARGS="--full", ARGS="--only triangles"
bench-growth: all build/meshes/ball.ply
	@python3 test/bench/bench_growth.py $(build) $(ARGS)

# What it computes, held against known answers.
check-bench:
	@python=$(build)/bench/venv/bin/python; test -x $$python || python=python3; \
	    if $$python -c 'import numpy' 2>/dev/null; then $$python -W ignore test/bench/check_bench.py; \
	    else echo "check-bench: skipped: no numpy (make bench-peers)"; fi

build/meshes/ball.ply: test/bench/make_ball.py
	@mkdir -p $(@D)
	python3 $< $@

$(build)/test/bench/%.o: test/bench/%.c | $(first)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_all) -Ilib -c -o $@ $<

$(build)/test/bench/worker: $(build)/test/bench/worker.o $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $^ $(libs)

-include $(wildcard $(build)/test/bench/*.d)
