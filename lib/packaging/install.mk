# install.mk -- what is installed, and other machines. Included by the Makefile.

##@ Installing

PREFIX ?= /usr/local
prefix ?= $(PREFIX)
bindir ?= $(prefix)/bin
libdir ?= $(prefix)/lib
includedir ?= $(prefix)/include
datadir ?= $(prefix)/share
mandir ?= $(datadir)/man

version := $(shell sed -n 's/^.define BRUME_VERSION "\(.*\)"/\1/p' lib/brume.h)
# What the manual pages are dated.
version_date := 2026-11-30

# The help of every command, which manual page and completions are made from. A program for another machine needs
# RUN=qemu-aarch64 or the like.
$(build)/help.txt: $(build)/render-cli
	for command in '' $$($(RUN) $< --help | sed -n 's/^  render-cli \([a-z]*\) [SF].*/\1/p'); do \
	    $(RUN) $< $$command --help || exit 1; \
	done > $@.tmp && mv $@.tmp $@

from_help = awk -v version=$(version) -v date=$(version_date) -f lib/packaging/roff.awk -f apps/packaging/render-cli.awk -v what=

$(build)/completions/render-cli.%: $(build)/help.txt apps/packaging/render-cli.awk lib/packaging/roff.awk
	@mkdir -p $(@D)
	$(from_help)$* $< > $@.tmp && mv $@.tmp $@

$(build)/man/render-cli.1: $(build)/help.txt apps/packaging/render-cli.awk lib/packaging/roff.awk
	@mkdir -p $(@D)
	$(from_help)man $< > $@.tmp && mv $@.tmp $@

# The pages of section 3 come all at once.
$(build)/man/brume.3: lib/brume.h lib/packaging/man.awk lib/packaging/roff.awk
	@mkdir -p $(@D)
	rm -f $(@D)/*.3
	awk -v out=$(@D) -v version=$(version) -v date=$(version_date) -f lib/packaging/roff.awk -f lib/packaging/man.awk $<

completions := $(patsubst %,$(build)/completions/render-cli.%,bash zsh fish)
to_install := $(build)/$(shared) $(build)/libbrume.a $(build)/render-cli $(build)/man/render-cli.1 \
              $(build)/man/brume.3 $(completions)

empty :=
static_libraries := $(subst $(empty) -l,;,$(subst -framework ,-l,$(libs)))
place = DESTDIR='$(DESTDIR)' prefix='$(prefix)' bindir='$(bindir)' libdir='$(libdir)' includedir='$(includedir)' \
        mandir='$(mandir)' datadir='$(datadir)' version='$(version)' shared='$(shared)' linked='$(linked)' \
        static_libraries='$(patsubst -l%,%,$(static_libraries))' sh lib/packaging/install.sh

.PHONY: install uninstall check-install check-completions
## install: the library, its header, render-cli, manual pages, completions; PREFIX=/usr/local, DESTDIR=
install: $(to_install)
	@$(place) install $(build)
	@echo "installed into $(DESTDIR)$(prefix)"

## uninstall: the same files, gone
uninstall: $(build)/man/brume.3
	@$(place) uninstall $(build)

## check-install: installed into temporary folders, used from C, C++ and CMake, removed
check-install: $(to_install)
	@sh lib/deps.sh mandoc man-db cmake pkgconf || echo "check-install: does what it can"
	@sh test/check_install.sh $(build) '$(MAKE)' '$(CC)' '$(CXX)'

# shells=1: installs zsh and fish; else they are asked if they are there.
## check-completions: completions in bash, and in zsh and fish where these are; shells=1: installs them
check-completions: $(completions) $(build)/help.txt
	$(if $(shells),@sh lib/deps.sh zsh fish)
	@sh test/check_completions.sh $(build)

##@ Other machines, as far as they can be tried from here (cross compilers are installed)

.PHONY: check-aarch64 check-mingw check-musl
## check-aarch64: two pictures under qemu, in float and double, with the bits of this machine's
check-aarch64: $(build)/render-cli $(build)/test/measure_difference
	@sh lib/deps.sh gcc-aarch64-linux-gnu g++-aarch64-linux-gnu qemu-user-static || :
	@sh test/check_aarch64.sh $(build) '$(MAKE)'; code=$$?; [ $$code -eq 77 ] || exit $$code

## check-mingw: for Windows: built, other libraries stubbed, started where there is Wine
check-mingw: $(build)/render-cli
	@sh lib/deps.sh gcc-mingw-w64-x86-64-posix g++-mingw-w64-x86-64-posix || :
	@sh test/check_mingw.sh $(build) '$(MAKE)'; code=$$?; [ $$code -eq 77 ] || exit $$code

## check-musl: the C part with musl: built, other libraries stubbed, started
check-musl: $(build)/render-cli
	@sh lib/deps.sh musl-tools || :
	@sh test/check_musl.sh $(build) '$(MAKE)'; code=$$?; [ $$code -eq 77 ] || exit $$code
