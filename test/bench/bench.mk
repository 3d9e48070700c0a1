# bench.mk -- what is measured: estimators against each other, brume against other renderers and against earlier
# commits. Included by the Makefile.

##@ Measuring

.PHONY: study-picture ladder estimates bench-effects bench bench-peers bench-traversal bench-build bench-quick \
        bench-growth bench-scaling check-bench

## study-picture: scenes/pictures/three-spots-study.svg: the plot that README.md shows
study-picture: $(build)/render-cli meshes
	$(build)/render-cli study scenes/three-spots.xml -o out/three-spots-study $(ARGS)
	@mkdir -p scenes/pictures
	cp out/three-spots-study/study.svg scenes/pictures/three-spots-study.svg

# ARGS="--scenes open-beam --rungs mis,raster": what to compare, and how long
## ladder: out/ladder/: every estimator in every scene of scenes/ladder/; ARGS="--quick"; build/ladder --help
ladder: $(build)/ladder meshes
	@sh lib/deps.sh imagemagick fonts-dejavu-core
	$(build)/ladder $(ARGS)

# ARGS="--scene slats --seeds 20 --size 160x100"
## estimates: is a picture as wrong as it says, and done when it said? A table, in about ten minutes
estimates: $(build)/estimates meshes
	$(build)/estimates $(ARGS)

# ARGS="--bits": what each feature bit is worth; --rounds=N, --scene=I
## bench-effects: what leaving out code is worth, scene by scene: the table of the README
bench-effects: $(build)/bench-effects meshes
	@sh lib/deps.sh python3
	$(build)/bench-effects $(build) $(ARGS)

## bench-peers: installs these (from PyPI, into build/bench/venv; and libllvm19, for Mitsuba)
bench-peers:
	@sh lib/deps.sh python3 python3-venv libllvm19 || echo "bench-peers: no libllvm19: Mitsuba is scalar"
	python3 test/bench/bench.py $(build) --install

# A quarter of an hour once its references are rendered; build/bench/venv/bin/python test/bench/bench.py --help
## bench: against Mitsuba, Cycles and LuxCore: out/bench/; ARGS="--quick --scenes open-beam --peers cycles"
bench: all $(build)/test/bench/worker build/meshes/ball.ply
	@python3 test/bench/bench.py $(build) $(ARGS)

# On one core. ARGS=11: rounds
## bench-traversal: rays a second against Embree (libembree-dev, which it installs), on one core
bench-traversal:
	@sh lib/deps.sh libembree-dev
	@$(MAKE) --no-print-directory $(build)/test/bench/traversal
	@mkdir -p out/bench
	POCL_MAX_PTHREAD_COUNT=1 taskset -c 0 $(build)/test/bench/traversal out/bench/traversal.json $(ARGS)

$(build)/test/bench/traversal: $(patsubst %,$(build)/test/bench/%.o,traversal traversal_meshes) $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $^ -lembree3 $(libs)

# ARGS="1 5": meshes of up to a million triangles, five rounds
## bench-build: building the hierarchy against Embree: time and memory
bench-build:
	@sh lib/deps.sh libembree-dev
	@$(MAKE) --no-print-directory $(build)/test/bench/hierarchy
	@mkdir -p out/bench
	$(build)/test/bench/hierarchy out/bench/hierarchy.json $(ARGS)

$(build)/test/bench/hierarchy: $(patsubst %,$(build)/test/bench/%.o,hierarchy traversal_meshes) $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $^ -lembree3 $(libs)

# This tree against an earlier commit, a minute: make bench-quick BASE=main~10
## bench-quick: BASE=COMMIT: is this tree slower than that? Ratios, in a minute
bench-quick: all build/meshes/ball.ply
	@test -n "$(BASE)" || { echo "bench-quick: which commit? BASE=main~10" >&2; exit 2; }
	@python3 test/bench/bench_quick.py $(build) $(BASE) $(ARGS)

# ARGS="--full", ARGS="--only triangles"
## bench-growth: time and memory against triangles, lights, pixels, samples, depth; ARGS="--full"
bench-growth: all build/meshes/ball.ply
	@python3 test/bench/bench_growth.py $(build) $(ARGS)

# ARGS="--rounds 9", ARGS="--only beam"
## bench-scaling: one core against more, and against the same cores as two devices: how much of their speed is there
bench-scaling: all build/meshes/ball.ply
	@sh lib/deps.sh python3
	@python3 test/bench/bench_scaling.py $(build) $(ARGS)

# What it computes, held against known answers.
## check-bench: what bench computes, held against known answers
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
