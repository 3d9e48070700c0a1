# test.mk -- tests, one program per subject, linked with the static library to reach its internals, and checks of all
# kinds. Included by the Makefile.

##@ Tests

.PHONY: test trust fuzz stability exhaustive watertight check-platform identity check-abi check-threads check-cl \
        check-oclgrind check-intel crosscheck check-study check-pictures check-blender check-slurm check-help \
        check-readme fuzzers threads-checked

tests := $(patsubst test/%.c,$(build)/test/%,$(wildcard test/test_*.c))
test_programs := $(wildcard test/test_*.c test/measure_*.c)
test_support := $(patsubst test/%.c,$(build)/test/%.o,$(filter-out $(test_programs),$(wildcard test/*.c)))

$(build)/test/%.o: test/%.c | $(first)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_all) -Ilib -c -o $@ $<

$(build)/test/test_%: $(build)/test/test_%.o $(test_support) $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $(filter %.o,$^) $(build)/libbrume.a -lcmocka $(libs)

# Measurements that need the library's internals: made and run by hand.
$(build)/test/measure_%: $(build)/test/measure_%.o $(test_support) $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $(filter %.o,$^) $(build)/libbrume.a -lcmocka $(libs)

# The public header is held to the oldest languages it promises to compile in.
$(build)/test/header_cxx.o: test/header_cxx.cc | $(first)
	@mkdir -p $(@D)
	$(CXX) $(CXXFLAGS_all) -std=c++98 -pedantic-errors -Ilib -c -o $@ $<

$(build)/test/test_ladder $(build)/test/test_study_figures: $(judging)
$(build)/test/test_headers: $(build)/test/header_cxx.o
$(build)/test/test_cli_duration: $(build)/apps/cli_duration.o
fuzzable := $(patsubst %,$(build)/test/%.o,fuzz/guard fuzz/seeds fuzz/targets jpeg_file)
$(build)/test/test_hostile: $(fuzzable)
faulty := $(patsubst test/%.c,$(build)/test/%.o,$(wildcard test/faults/*.c))
$(patsubst test/%.c,$(build)/test/%,$(shell grep -l '"faults/' $(test_programs))): $(faulty)
$(build)/test/test_headers.o: CFLAGS_all += -pedantic-errors

## test: every test; ends with "N passed, N failed, N skipped"
test: all meshes $(tests) $(build)/fail_launches.so
	@sh test/run.sh $(build) $(sort $(tests))

# The tests that say how far off they are, as one table.
stable := $(patsubst test/%.c,$(build)/test/%,$(shell grep -l '"stability.h"\|"hazards.h"' test/test_*.c))

## stability: what must hold at the extremes: case, reference, tolerance, worst error, where
stability: all meshes $(stable) $(build)/test/measure_agreement $(build)/test/measure_difference
	@sh test/stability.sh $(build) $(sort $(stable))

# ARGS="cached": one of the sessions only
## trust: OpenCL calls with every error, allocations, writes, hostile files: how many were tried, how many lost
trust: $(build)/test/measure_cl_faults $(build)/test/measure_memory $(build)/test/measure_file_faults
	@sh test/trust.sh "$(build)/test/measure_cl_faults $(ARGS)" $(build)/test/measure_memory \
	    $(build)/test/measure_file_faults "$(MAKE) -s fuzz SECONDS=20"

# SECONDS=600, or RUNS=20000: for each reader
SECONDS ?= 60
## fuzz: the readers of files by libFuzzer, a minute each; SECONDS=600; RUNS=20000: as many, always the same
fuzz:
	@sh lib/deps.sh libclang-rt-$$(clang -dumpversion | cut -d. -f1)-dev >&2
	@$(MAKE) -s config=fuzz CC=clang fuzzers >&2
	@sh test/fuzz/fuzz.sh build/fuzz-clang $(SECONDS) $(RUNS)

fuzzers := $(patsubst %,$(build)/test/fuzz/fuzz_%,scene obj ply picture checkpoint)
fuzzers: $(fuzzers)

$(build)/test/fuzz/drive_%.o: test/fuzz/drive.c
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_all) -Ilib -DTARGET=$* -c -o $@ $<

$(build)/test/fuzz/fuzz_%: $(build)/test/fuzz/drive_%.o $(fuzzable) $(build)/libbrume.a
	$(CXX) $(link_flags) -fsanitize=fuzzer -o $@ $^ $(libs)

## exhaustive: test/exhaustive.md: the kernels' functions over every float, half an hour; ARGS="lexp": only that
exhaustive: $(build)/test/measure_exhaustive
	BRUME_CACHE_DIR= $(build)/test/measure_exhaustive test/exhaustive.md $(ARGS)

RAYS ?= 1e9
## watertight: rays from within closed meshes by every traversal, none of which may get out; 20 minutes; RAYS=1e8
watertight: $(build)/test/test_watertight
	BRUME_WATERTIGHT_RAYS=$(RAYS) BRUME_CACHE_DIR= BRUME_BUILD=$(build) $(build)/test/test_watertight

## check-platform: POSIX, GNU and Windows are asked in platform files alone
check-platform: | $(first)
	@sh test/check_platform.sh $(CC)

##@ Checks

# room.xml is a part of other scenes.
SCENES ?= $(sort $(filter-out scenes/ladder/room.xml,$(wildcard scenes/*.xml scenes/ladder/*.xml)))
## identity: do features that a scene doesn't call for change its bits? Some minutes; SCENES=scenes/furnace.xml
identity: $(build)/test/measure_identity meshes
	BRUME_CACHE_DIR= $(build)/test/measure_identity $(SCENES)

# BASE=v0.1.0
## check-abi: BASE=COMMIT: would a program go on with this library? By abidiff
check-abi:
	@sh lib/deps.sh abigail-tools
	@sh test/check_abi.sh '$(BASE)' '$(MAKE)' '$(CC)'; code=$$?; [ $$code -eq 77 ] || exit $$code

# The threads of the tests and of the library under ThreadSanitizer, and races planted into it.
## check-threads: contexts in several threads under ThreadSanitizer
check-threads:
	@$(MAKE) -s config=threads CC='$(CC)' threads-checked
threads-checked: $(build)/test/test_threads
	@sh test/check_threads.sh $(build) '$(CC)' '$(CFLAGS_all)' '$(libs)'

## check-help: `make help` lists what there is, and README.md names nothing else
check-help:
	@sh test/check_help.sh '$(MAKE)' README.md $(filter-out %.d,$(MAKEFILE_LIST))

## check-readme: README.md at its word: links, options, its scene, its program
check-readme: $(build)/render-cli
	@sh test/check_readme.sh $(build) '$(CC)' '$(libs)'

## check-cl: every kernel entry point checked by clang as OpenCL C 1.2
check-cl: | $(first)
	@sh test/check_cl.sh $(sort $(entry_points))

## check-oclgrind: every scene, a few pixels of it, inside Oclgrind: memory errors, races, values never set
check-oclgrind: $(build)/render-cli $(build)/fill_buffer.so meshes
	@sh test/check_oclgrind.sh $(build) $(sort $(wildcard scenes/*.xml))

# Put before libOpenCL in render-cli.
$(build)/%.so: test/preload/%.c | $(first)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) -O2 -shared -fPIC -o $@ $< -ldl

# ARGS="scenes/forest.xml": these scenes
## check-intel: the same samples from PoCL and from Intel's OpenCL runtime (from PyPI)
check-intel: $(build)/test/measure_agreement
	@sh lib/deps.sh python3 python3-venv
	@sh test/check_intel.sh $(build) $(or $(ARGS),scenes/one-spot.xml scenes/glass-in-fog.xml scenes/ladder/slats.xml); \
	    code=$$?; [ $$code -eq 77 ] || exit $$code

# quick=1: the part for CI
##@ Checks against other programs

## crosscheck: compare with Mitsuba 3 (from PyPI); quick=1: in part
crosscheck: $(build)/render-cli
	@sh lib/deps.sh python3 python3-venv libllvm19
	python3 test/crosscheck/crosscheck.py $(build) $(if $(quick),--quick)

# browser=1: installs Chromium, which is large
## check-study: a small study; its figures against numpy and NVIDIA's FLIP (from PyPI), its page in Chromium
check-study: $(build)/render-cli meshes
	@sh lib/deps.sh python3 python3-venv $(if $(browser),chromium)
	@sh test/study/check_study.sh $(build); code=$$?; \
	    [ $$code -eq 77 ] && echo "check-study: in part skipped" || exit $$code

## check-blender: the Blender exporter against Cycles (Blender's module for Python, from PyPI)
check-blender: $(build)/render-cli
	@sh lib/deps.sh python3 python3-venv
	@python3 test/blender/check_blender.py $(build) $(ARGS); code=$$?; [ $$code -eq 77 ] || exit $$code

# quick=1: the part for CI: no denoiser; oiiotool where it is installed
## check-pictures: layers as OpenEXR's module for Python and oiiotool read them; the denoiser (from PyPI); quick=1
check-pictures: $(build)/render-cli $(if $(quick),,$(build)/test/test_denoise)
	@sh lib/deps.sh python3 python3-venv $(if $(quick),,openimageio-tools) || echo "check-pictures: does what it can"
	@sh test/pictures/check_pictures.sh $(build) $(if $(quick),quick); code=$$?; \
	    [ $$code -eq 77 ] && echo "check-pictures: in part skipped" || exit $$code

## check-slurm: apps/farm/ under a real Slurm, started for the check (as root)
check-slurm: $(build)/render-cli
	@sh lib/deps.sh slurmctld slurmd slurm-client parallel
	@sh test/check_slurm.sh $(build); code=$$?; [ $$code -eq 77 ] || exit $$code
