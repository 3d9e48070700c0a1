# check_install.sh BUILD MAKE CC CXX -- `make install` into a temporary prefix, and into a DESTDIR; what lies there used
# from C99 and C++98 by pkg-config, shared and static, and by CMake; the manual pages linted; `make uninstall`, after
# which nothing is left. Tools that are missing are named and their part is skipped.
build=$1 make=$2 CC=$3 CXX=$4
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
prefix=$folder/prefix
export PKG_CONFIG_PATH=$prefix/lib/pkgconfig BRUME_CACHE_DIR=$folder/cache LD_LIBRARY_PATH=$prefix/lib
bad=0

fail() {
    echo "check-install: $*" >&2
    bad=$((bad + 1))
}
has() { command -v "$1" >/dev/null || { echo "check-install: SKIPPED: no $1"; return 1; }; }
quietly() { "$@" >"$folder/log" 2>&1 || { cat "$folder/log"; fail "failed: $*"; }; }
here() { (cd "$1" && find . ! -type d | sort); }

quietly "$make" -s install PREFIX="$prefix"
quietly "$make" -s install PREFIX=/usr DESTDIR="$folder/stage" libdir=/usr/lib/somewhere
[ "$(here "$prefix" | wc -l)" -gt 60 ] || fail "few files were installed"
[ "$(here "$prefix")" = "$(here "$folder/stage/usr" | sed 's|/lib/somewhere/|/lib/|' | sort)" ] ||
    fail "DESTDIR has other files than the prefix"
grep -rIl "$folder" "$folder/stage" && fail "files below DESTDIR name it"

# ---- the library ----

readelf -d "$prefix/lib/libbrume.so" | grep -q 'SONAME.*\[libbrume.so.0\]' || fail "the SONAME is not libbrume.so.0"
sed -n 's/^BRUME_API .*\(brume_[a-z0-9_]*\)(.*/\1@@BRUME_0/p' lib/brume.h | sort >"$folder/declared"
nm -D --defined-only --with-symbol-versions "$prefix/lib/libbrume.so" | sed -n 's/.* [^A] //p' | sort >"$folder/exported"
diff "$folder/declared" "$folder/exported" >"$folder/log" || { cat "$folder/log"; fail "exports are not what brume.h declares"; }

# run PROGRAM: it renders, and has the library from where it was installed, or within itself.
run() {
    [ -x "$1" ] || return
    [ "$("$1")" = "brume $(sed -n 's/.*BRUME_VERSION "\(.*\)"/\1/p' lib/brume.h)" ] || fail "${1##*/} does not do"
    case $1 in
        *static) ldd "$1" | grep -q libbrume && fail "${1##*/} loads the shared library" ;;
        *) ldd "$1" | grep -q "libbrume.so.0 => $prefix/lib/" || fail "${1##*/} loads another library" ;;
    esac
}

if has pkg-config; then
    cp test/install/use_brume.c "$folder/use_brume.cc"
    quietly $CC -std=c99 -pedantic-errors -Wall -Werror test/install/use_brume.c $(pkg-config --cflags --libs brume) \
        -o "$folder/c_shared"
    quietly $CXX -std=c++98 -Wall -Werror "$folder/use_brume.cc" $(pkg-config --cflags --libs brume) -o "$folder/cxx_shared"
    # --static gives -lbrume, which the linker takes for the shared one unless told.
    quietly $CC -std=c99 test/install/use_brume.c $(pkg-config --cflags --static --libs brume |
        sed "s|-lbrume|$prefix/lib/libbrume.a|") -o "$folder/c_static"
    run "$folder/c_shared"
    run "$folder/cxx_shared"
    run "$folder/c_static"
fi
if has cmake; then
    # Moved: the CMake package finds its own files.
    mv "$prefix" "$folder/moved"
    quietly cmake -S test/install -B "$folder/cmake" -DCMAKE_C_COMPILER="${CC##* }" -DCMAKE_PREFIX_PATH="$folder/moved"
    quietly cmake --build "$folder/cmake"
    mv "$folder/moved" "$prefix"
    run "$folder/cmake/use_shared"
    run "$folder/cmake/use_static"
fi

# ---- manual pages ----

if has mandoc; then
    # Pages that lead to others by .so are left to man.
    mandoc -T lint -W warning $(grep -L '^\.so ' "$prefix"/share/man/man[13]/*) || fail "mandoc has something to say"
fi
if has man; then
    for page in "$prefix"/share/man/man[13]/*; do
        name=${page##*/}
        text=$(MANPATH=$prefix/share/man MANWIDTH=100 man --warnings "${name##*.}" "${name%.*}" 2>"$folder/log")
        [ -s "$folder/log" ] && { cat "$folder/log"; fail "man has something to say of $name"; }
        echo "$text" | tr '\342\200\220' '---' | grep -qi "${name%%[-_.]*}" || fail "$name shows nothing"
        case $name in brume_*) echo "$text" | grep -q "${name%.3}(" || fail "$name leads to a page without it" ;; esac
    done
fi

# ---- and away ----

quietly "$make" -s uninstall PREFIX="$prefix"
quietly "$make" -s uninstall PREFIX=/usr DESTDIR="$folder/stage" libdir=/usr/lib/somewhere
left=$(find "$prefix" "$folder/stage" ! -type d -o -name '*brume*')
[ -z "$left" ] || fail "left behind: $left"

[ $bad -eq 0 ] && echo "check-install: installed, used and removed"
[ $bad -eq 0 ]
