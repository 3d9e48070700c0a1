# `make help` lists the targets. Here: what is built. test/test.mk tests and checks, test/bench/bench.mk measures,
# lib/packaging/install.mk installs.

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

$(if $(filter release debug sanitize threads fuzz coverage,$(config)),,\
    $(error config=$(config): there are release, debug, sanitize, threads, fuzz and coverage))

warnings := -Wall -Wextra -Wshadow -Wpointer-arith -Wvla
code.linux := -fPIC -fvisibility=hidden
code.macos := -fPIC -fvisibility=hidden
# By the attribute format(printf) MinGW means Microsoft's, which we don't use; formats are checked elsewhere.
code.windows := -D__USE_MINGW_ANSI_STDIO=1 -DBRUME_BUILD_DLL -Wno-format -Wno-format-extra-args
common := $(flags.$(config)) $(code.$(platform)) -MMD -MP $(warnings)
CFLAGS_all := -std=c99 -D_POSIX_C_SOURCE=200809L -Wmissing-prototypes -Wstrict-prototypes $(common) $(CFLAGS)
CXXFLAGS_all := -std=c++17 $(common) $(CXXFLAGS)
link_flags := $(flags.$(config)) $(LDFLAGS)
libs.linux := -lOpenCL -lOpenEXRCore -lexpat -ljpeg -lz -lstdc++ -lm -lpthread -ldl
libs.macos := -framework OpenCL -lOpenEXRCore -lexpat -ljpeg -lz -lc++
libs.windows := -lOpenCL -lOpenEXRCore -lexpat -ljpeg -lz -lstdc++ -lm -lws2_32
libs := $(libs.$(platform))

# The operating system behind one file: lib/platform.h, apps/platform.h.
this_platform := $(if $(filter windows,$(platform)),windows,posix)
other_platform := $(if $(filter windows,$(platform)),posix,windows)
lib_sources := $(filter-out lib/platform_$(other_platform).c,$(wildcard lib/*.c lib/*.cc))
lib_objects := $(patsubst %,$(build)/%.o,$(basename $(lib_sources))) $(build)/sources.o
cl_files := $(wildcard cl/*.cl cl/*.h)
entry_points := $(wildcard cl/*.cl)

# `make deps demo` on a bare system: whatever needs a compiler waits for deps, with -j too.
first := $(filter deps,$(MAKECMDGOALS))

.PHONY: help all deps meshes demo blender-addon clean
.SECONDARY:

##@ Building

## all: build/libbrume.so.0, build/libbrume.a, build/render-cli, build/example, build/ladder; the default
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

## deps: install what is missing (Debian, Ubuntu; elsewhere: what to install)
deps:
	@sh lib/deps.sh

# PoCL asks hwloc for cores and memory, and aborts if that knows nothing: in a chroot without /sys it is told.
ifeq ($(wildcard /sys/devices/system/cpu/*),)
export HWLOC_SYNTHETIC ?= numa:1(memory=4294967296) pu:$(shell nproc)
endif

# Scenes say ../build/meshes/..., so this folder is the same for every configuration.
## meshes: build/meshes/: what scenes/ refers to, grown by apps/make-bunny.c and apps/make-forest.c
meshes: build/meshes/bunny.obj build/meshes/forest.ply

build/meshes/bunny.obj: apps/make-bunny.c | $(build)/make-bunny
	@mkdir -p $(@D)
	$(build)/make-bunny $@.tmp && mv $@.tmp $@

build/meshes/forest.ply: apps/make-forest.c | $(build)/make-forest
	@mkdir -p $(@D)
	$(build)/make-forest $@.tmp $(@D)/ground.ply && mv $@.tmp $@

## demo: render out/three-spots.exr and .png
demo: $(build)/render-cli build/meshes/bunny.obj
	@mkdir -p out
	$(build)/render-cli scenes/three-spots.xml --spp 32 -v -o out/three-spots.exr -o out/three-spots.png

# The add-on as a file to install: Edit > Preferences > Add-ons > Install from Disk
$(build)/brume_export.zip: $(wildcard apps/blender/brume_export/*.py)
	@sh lib/deps.sh python3
	@rm -rf apps/blender/brume_export/__pycache__
	cd apps/blender && python3 -m zipfile -c $(abspath $@) brume_export

## blender-addon: build/brume_export.zip, the exporter as Blender installs it
blender-addon: $(build)/brume_export.zip

## help: this list
help:
	@awk '/^##@ / { print "\n" substr($$0, 5) } \
	     /^## / { colon = index($$0, ":"); printf "  make %-18s %s\n", substr($$0, 4, colon - 4), substr($$0, colon + 2) }' \
	    $(filter-out %.d,$(MAKEFILE_LIST))
	@echo
	@echo 'config=release (default) | debug | sanitize | threads | coverage;  CC=gcc | clang'

## clean: removes build/ and out/
clean:
	rm -rf build out

include test/test.mk
include test/bench/bench.mk
include lib/packaging/install.mk

-include $(wildcard $(build)/*.d $(build)/*/*.d $(build)/*/*/*.d)
