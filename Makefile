# make deps          install what is missing (Debian, Ubuntu; elsewhere: what to install)
# make               build/libbrume.so.0, build/libbrume.a, build/render-cli, build/example, build/ladder
# make demo          render out/three-spots.exr and .png
# make meshes        build/meshes/: what scenes/ refers to, grown by apps/make-bunny.c and apps/make-forest.c
# make test          every test; ends with "N passed, N failed, N skipped"
# make trust         every OpenCL call with every error, every allocation, hostile files: how many, how many were lost
# make fuzz          the readers of files by libFuzzer, a minute each; SECONDS=600; RUNS=20000: as many, always the same
# make stability     what must hold at the extremes: case, reference, tolerance, worst error, where
# make exhaustive    test/exhaustive.md: the kernels' functions over every float there is, in half an hour;
#                    ARGS="lexp llog": only these
# make check-platform POSIX, GNU and Windows are asked in platform files alone
# make identity      every scene file, with every feature that it doesn't call for built in as well: the same bits? In
#                    some minutes; SCENES=scenes/furnace.xml: only that
# make check-abi     BASE=COMMIT: would a program go on with this library? By abidiff
# make check-threads contexts in several threads under ThreadSanitizer
# make check-cl      every kernel entry point checked by clang as OpenCL C 1.2
# make check-oclgrind every scene, a few pixels of it, inside Oclgrind: memory errors, races, values never set
# make check-intel   the same samples from PoCL and from Intel's OpenCL runtime (from PyPI, into build/)
# make crosscheck    compare with Mitsuba 3 (installed from PyPI into build/)
# make ladder        out/ladder/: every estimator in every scene of scenes/ladder/, error against time; ARGS="--quick"
#                    and so on: build/ladder --help
# make estimates     is a picture as wrong as it says, and done when it said? A table, in about ten minutes
# make check-study   a small study; its figures against numpy and NVIDIA's FLIP (from PyPI), its page in Chromium
# make check-pictures layers as OpenEXR's module for Python and oiiotool read them; the denoiser (from PyPI)
# make check-blender the Blender exporter against Cycles (Blender's module for Python, from PyPI, into build/)
# make check-slurm    apps/farm/ under a real Slurm, started for the check (as root)
# make study-picture scenes/pictures/three-spots-study.svg: the plot that README.md shows
# make bench         against Mitsuba, Cycles and LuxCore: out/bench/; ARGS="--quick --scenes open-beam --peers cycles"
# make bench-peers   installs these (from PyPI, into build/bench/venv; and libllvm19, for Mitsuba)
# make bench-traversal rays a second against Embree (libembree-dev, which it installs), on one core
# make bench-quick BASE=commit is this tree slower than that? Ratios, in a minute
# make bench-growth  time and memory against triangles, lights, pixels, samples, depth, cores; ARGS="--full"
# make check-bench   what bench computes, held against known answers
# make bench-effects what leaving out code is worth, scene by scene: the table of the README
# make check-aarch64, check-mingw, check-musl: other systems, as far as they can be tried from here
# make install        PREFIX=/usr/local, DESTDIR=: lib/packaging/install.mk; uninstall, check-install, check-completions
# make clean
# config=release (default) | debug | sanitize | threads | coverage;  CC=gcc | clang

config ?= release
ifeq ($(origin CC),default)
CC := gcc
CXX := g++
endif
ifneq ($(findstring clang,$(CC)),)
CXX := $(subst clang,clang++,$(CC))
endif
ifneq ($(findstring -gcc,$(CC)),)
CXX := $(subst -gcc,-g++,$(CC))
AR := $(subst -gcc,-ar,$(CC))
endif

# What the compiler builds for. CC=x86_64-w64-mingw32-gcc and the like build for another machine.
triple := $(shell $(CC) -dumpmachine 2>/dev/null)
platform := $(if $(findstring mingw,$(triple)),windows,$(if $(findstring apple,$(triple)),macos,linux))

# The shared library by the name that programs load (abi: the number in it) and the one that they link.
abi := 0
shared.linux := libbrume.so.$(abi)
shared.macos := libbrume.$(abi).dylib
shared.windows := libbrume-$(abi).dll
linked.linux := libbrume.so
linked.macos := libbrume.dylib
linked.windows := libbrume.dll.a
share.linux = -shared -Wl,-soname,$(@F),--version-script=lib/exports.map
share.macos = -dynamiclib -install_name @rpath/$(@F) -Wl,-exported_symbol,_brume_*
share.windows = -shared -Wl,--version-script=lib/exports.map,--out-implib,$(@D)/$(linked.windows)
shared := $(shared.$(platform))
linked := $(linked.$(platform))

# The default configuration builds into build/, every other compiler or configuration beside it.
build := build
ifneq ($(config)$(notdir $(CC)),releasegcc)
build := build/$(config)-$(notdir $(CC))
endif

flags.release := -O2 -DNDEBUG
flags.debug := -O0 -g3
flags.sanitize := -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
flags.threads := -O1 -g -fsanitize=thread
flags.fuzz := $(flags.sanitize) -fsanitize=fuzzer-no-link
flags.coverage := -O0 -g --coverage

warnings := -Wall -Wextra -Wshadow -Wpointer-arith -Wvla
code.linux := -fPIC -fvisibility=hidden
code.macos := -fPIC -fvisibility=hidden
# By the attribute format(printf) MinGW means Microsoft's, which we don't use; formats are checked elsewhere.
code.windows := -D__USE_MINGW_ANSI_STDIO=1 -DBRUME_BUILD_DLL -Wno-format -Wno-format-extra-args
common := $(flags.$(config)) $(code.$(platform)) -MMD -MP $(warnings)
CFLAGS_all := -std=c99 -D_POSIX_C_SOURCE=200809L -Wmissing-prototypes -Wstrict-prototypes $(common) $(CFLAGS)
CXXFLAGS_all := -std=c++17 $(common) $(CXXFLAGS)
link_flags := $(flags.$(config)) $(LDFLAGS)
libs.linux := -lOpenCL -lOpenEXRCore -lexpat -lz -lstdc++ -lm -lpthread -ldl
libs.macos := -framework OpenCL -lOpenEXRCore -lexpat -lz -lc++
libs.windows := -lOpenCL -lOpenEXRCore -lexpat -lz -lstdc++ -lm -lws2_32
libs := $(libs.$(platform))

# The operating system behind one file: lib/platform.h, apps/platform.h.
this_platform := $(if $(filter windows,$(platform)),windows,posix)
other_platform := $(if $(filter windows,$(platform)),posix,windows)
lib_sources := $(filter-out lib/platform_$(other_platform).c,$(wildcard lib/*.c lib/*.cc))
lib_objects := $(patsubst %,$(build)/%.o,$(basename $(lib_sources))) $(build)/sources.o
cl_files := $(wildcard cl/*.cl cl/*.h)
entry_points := $(wildcard cl/*.cl)
tests := $(patsubst test/%.c,$(build)/test/%,$(wildcard test/test_*.c))
test_programs := $(wildcard test/test_*.c test/measure_*.c)
test_support := $(patsubst test/%.c,$(build)/test/%.o,$(filter-out $(test_programs),$(wildcard test/*.c)))

# `make deps demo` on a bare system: whatever needs a compiler waits for deps, with -j too.
first := $(filter deps,$(MAKECMDGOALS))

.PHONY: all deps demo meshes test trust fuzz fuzzers stability exhaustive check-platform check-cl check-oclgrind \
        check-intel crosscheck check-study check-pictures check-blender blender-addon study-picture ladder estimates \
        bench-effects clean
.SECONDARY:
all: $(build)/$(shared) $(build)/libbrume.a $(build)/render-cli $(build)/example $(build)/ladder

$(build)/$(shared): $(lib_objects) lib/exports.map
	$(CC) $(share.$(platform)) $(link_flags) -o $@ $(lib_objects) $(libs)
	$(if $(filter windows,$(platform)),,ln -sf $(@F) $(@D)/$(linked))

$(build)/libbrume.a: $(lib_objects)
	rm -f $@
	$(AR) rcs $@ $^

$(build)/lib/%.o: lib/%.c | $(first)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_all) -c -o $@ $<

$(build)/lib/%.o: lib/%.cc | $(first)
	@mkdir -p $(@D)
	$(CXX) $(CXXFLAGS_all) -c -o $@ $<

# The kernels, embedded as C strings.
$(build)/sources.c: $(cl_files) lib/embed.sh
	@mkdir -p $(@D)
	sh lib/embed.sh $(sort $(cl_files)) > $@.tmp && mv $@.tmp $@

$(build)/sources.o: $(build)/sources.c | $(first)
	$(CC) $(CFLAGS_all) -Ilib -c -o $@ $<

$(build)/apps/%.o: apps/%.c | $(first)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS_all) -Ilib -c -o $@ $<

# What render-cli and ladder share.
judging := $(patsubst %,$(build)/apps/%.o,curves error_metrics estimators files flip picture_file \
            platform_$(this_platform) scene_hash small_png)

$(build)/render-cli: $(patsubst apps/%.c,$(build)/apps/%.o,$(wildcard apps/cli*.c)) $(judging) $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $^ $(libs)

$(build)/ladder: $(patsubst apps/%.c,$(build)/apps/%.o,$(wildcard apps/ladder*.c)) $(judging) $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $^ $(libs)

$(build)/estimates: $(build)/apps/error_metrics.o
$(build)/bench-effects: $(build)/apps/platform_$(this_platform).o

$(build)/%: $(build)/apps/%.o $(build)/libbrume.a
	$(CC) $(link_flags) -o $@ $^ $(libs)

deps:
	@sh lib/deps.sh

# PoCL asks hwloc for cores and memory, and aborts if that knows nothing: in a chroot without /sys it is told.
ifeq ($(wildcard /sys/devices/system/cpu/*),)
export HWLOC_SYNTHETIC ?= numa:1(memory=4294967296) pu:$(shell nproc)
endif

# ---- meshes and the demo ---------------------------------------------------------------------------------------------

# Scenes say ../build/meshes/..., so this folder is the same for every configuration.
meshes: build/meshes/bunny.obj build/meshes/forest.ply

build/meshes/bunny.obj: apps/make-bunny.c | $(build)/make-bunny
	@mkdir -p $(@D)
	$(build)/make-bunny $@.tmp && mv $@.tmp $@

build/meshes/forest.ply: apps/make-forest.c | $(build)/make-forest
	@mkdir -p $(@D)
	$(build)/make-forest $@.tmp $(@D)/ground.ply && mv $@.tmp $@

demo: $(build)/render-cli build/meshes/bunny.obj
	@mkdir -p out
	$(build)/render-cli scenes/three-spots.xml --spp 32 -v -o out/three-spots.exr -o out/three-spots.png

# ---- tests: one program per subject, linked with the static library to reach its internals ---------------------------

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
fuzzable := $(patsubst %,$(build)/test/fuzz/%.o,guard seeds targets)
$(build)/test/test_hostile: $(fuzzable)
faulty := $(patsubst test/%.c,$(build)/test/%.o,$(wildcard test/faults/*.c))
$(patsubst test/%.c,$(build)/test/%,$(shell grep -l '"faults/' $(test_programs))): $(faulty)
$(build)/test/test_headers.o: CFLAGS_all += -pedantic-errors

test: all meshes $(tests) $(build)/fail_launches.so
	@sh test/run.sh $(build) $(sort $(tests))

# The tests that say how far off they are, as one table.
stable := $(patsubst test/%.c,$(build)/test/%,$(shell grep -l '"stability.h"\|"hazards.h"' test/test_*.c))

stability: all meshes $(stable)
	@sh test/stability.sh $(build) $(sort $(stable))

# ARGS="cached": one of the sessions only
trust: $(build)/test/measure_cl_faults $(build)/test/measure_memory
	@sh test/trust.sh "$(build)/test/measure_cl_faults $(ARGS)" $(build)/test/measure_memory \
	    "$(MAKE) -s fuzz SECONDS=20"

# SECONDS=600, or RUNS=20000: for each reader
SECONDS ?= 60
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

exhaustive: $(build)/test/measure_exhaustive
	BRUME_CACHE_DIR= $(build)/test/measure_exhaustive test/exhaustive.md $(ARGS)

check-platform: | $(first)
	@sh test/check_platform.sh $(CC)

# room.xml is a part of other scenes.
SCENES ?= $(sort $(filter-out scenes/ladder/room.xml,$(wildcard scenes/*.xml scenes/ladder/*.xml)))
.PHONY: identity
identity: $(build)/test/measure_identity meshes
	BRUME_CACHE_DIR= $(build)/test/measure_identity $(SCENES)

# BASE=v0.1.0
check-abi:
	@sh lib/deps.sh abigail-tools
	@sh test/check_abi.sh '$(BASE)' '$(MAKE)' '$(CC)'; code=$$?; [ $$code -eq 77 ] || exit $$code
.PHONY: check-abi

# The threads of the tests and of the library under ThreadSanitizer, and races planted into it.
check-threads:
	@$(MAKE) -s config=threads CC='$(CC)' threads-checked
.PHONY: check-threads threads-checked
threads-checked: $(build)/test/test_threads
	@sh test/check_threads.sh $(build) '$(CC)' '$(CFLAGS_all)' '$(libs)'

check-cl: | $(first)
	@sh test/check_cl.sh $(sort $(entry_points))

check-oclgrind: $(build)/render-cli $(build)/fill_buffer.so meshes
	@sh test/check_oclgrind.sh $(build) $(sort $(wildcard scenes/*.xml))

# Put before libOpenCL in render-cli.
$(build)/%.so: test/preload/%.c | $(first)
	@mkdir -p $(@D)
	$(CC) $(CFLAGS) -O2 -shared -fPIC -o $@ $< -ldl

# ARGS="scenes/forest.xml": these scenes
check-intel: $(build)/test/measure_agreement
	@sh lib/deps.sh python3 python3-venv
	@sh test/check_intel.sh $(build) $(or $(ARGS),scenes/one-spot.xml scenes/glass-in-fog.xml scenes/ladder/slats.xml); \
	    code=$$?; [ $$code -eq 77 ] || exit $$code

# quick=1: the part for CI
crosscheck: $(build)/render-cli
	@sh lib/deps.sh python3 python3-venv libllvm19
	python3 test/crosscheck/crosscheck.py $(build) $(if $(quick),--quick)

# browser=1: installs Chromium, which is large
check-study: $(build)/render-cli meshes
	@sh lib/deps.sh python3 python3-venv $(if $(browser),chromium)
	@sh test/study/check_study.sh $(build); code=$$?; \
	    [ $$code -eq 77 ] && echo "check-study: in part skipped" || exit $$code

check-blender: $(build)/render-cli
	@sh lib/deps.sh python3 python3-venv
	@python3 test/blender/check_blender.py $(build) $(ARGS); code=$$?; [ $$code -eq 77 ] || exit $$code

check-pictures: $(build)/render-cli $(build)/test/test_denoise
	@sh lib/deps.sh python3 python3-venv openimageio-tools
	@sh test/pictures/check_pictures.sh $(build); code=$$?; \
	    [ $$code -eq 77 ] && echo "check-pictures: in part skipped" || exit $$code

.PHONY: check-slurm
check-slurm: $(build)/render-cli
	@sh lib/deps.sh slurmctld slurmd slurm-client parallel
	@sh test/check_slurm.sh $(build); code=$$?; [ $$code -eq 77 ] || exit $$code

# The add-on as a file to install: Edit > Preferences > Add-ons > Install from Disk
$(build)/brume_export.zip: $(wildcard apps/blender/brume_export/*.py)
	@rm -rf apps/blender/brume_export/__pycache__
	cd apps/blender && python3 -m zipfile -c $(abspath $@) brume_export
blender-addon: $(build)/brume_export.zip

study-picture: $(build)/render-cli meshes
	$(build)/render-cli study scenes/three-spots.xml -o out/three-spots-study $(ARGS)
	@mkdir -p scenes/pictures
	cp out/three-spots-study/study.svg scenes/pictures/three-spots-study.svg

# ARGS="--scenes open-beam --rungs mis,raster": what to compare, and how long
ladder: $(build)/ladder meshes
	@sh lib/deps.sh imagemagick fonts-dejavu-core
	$(build)/ladder $(ARGS)

# ARGS="--scene slats --seeds 20 --size 160x100"
estimates: $(build)/estimates meshes
	$(build)/estimates $(ARGS)

include test/bench/bench.mk

# ARGS="--bits": what each feature bit is worth; --rounds=N, --scene=I
bench-effects: $(build)/bench-effects meshes
	@sh lib/deps.sh python3
	$(build)/bench-effects $(build) $(ARGS)

include lib/packaging/install.mk

clean:
	rm -rf build out

-include $(wildcard $(build)/*.d $(build)/*/*.d $(build)/*/*/*.d)
