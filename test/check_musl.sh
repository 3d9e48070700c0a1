# check_musl.sh BUILD MAKE -- the C part of the library and render-cli compiled against musl instead of glibc, with
# warnings as errors; test_platform and render-cli's own options run on it.
#
# Debian has musl, but no C++ library and none of the others for it: as in check_mingw.sh their headers are this system's
# and their functions stubs that return 0, and so is the OBJ reader, which is C++. Nothing is rendered.
build=$1 make=$2
folder=$build/musl
command -v musl-gcc >/dev/null || { echo "check-musl: SKIPPED: no musl-gcc"; exit 77; }
fail() {
    echo "check-musl: $*" >&2
    exit 1
}
mkdir -p "$folder/include" || exit 1
for header in CL stb OpenEXR Imath expat.h expat_external.h zlib.h zconf.h jpeglib.h jmorecfg.h jerror.h; do
    [ -e /usr/include/$header ] || fail "no /usr/include/$header"
    ln -sfn /usr/include/$header "$folder/include/$header"
done
# libjpeg's settings differ between machines, and are where these are told apart.
for header in /usr/include/jconfig.h /usr/include/$(gcc -print-multiarch)/jconfig.h; do
    [ ! -e "$header" ] || ln -sfn "$header" "$folder/include/jconfig.h"
done

# objects FOLDER: what its C files become here; programs of one file, and the other system's part, left out.
objects() {
    for file in $(grep -L '^int main(' "$1"/*.c) ; do
        case $file in *_windows.c) ;; *) echo "$folder/${file%.c}.o" ;; esac
    done
}
library="$(objects lib) $folder/sources.o"
programs="$(objects apps) $folder/apps/cli.o"
"$make" -s CC=musl-gcc build="$folder" CFLAGS="-Werror -I$(pwd)/$folder/include" $library $programs >"$folder/log" 2>&1 ||
    { tail -n 30 "$folder/log"; fail "not built"; }

rm -f "$folder/libbrume.a" "$folder/libapps.a"
ar rcs "$folder/libbrume.a" $library && ar rcs "$folder/libapps.a" $programs || exit 1
names=$(nm -u "$folder/libbrume.a" | sed -n 's/^ *U \(cl[A-Z].*\|exr_.*\|compress2\|compressBound\|crc32\|jpeg_[a-zA-Z_]*\|XML_.*\|brume_mesh_read_obj\)$/\1/p' | sort -u)
[ "$(echo "$names" | wc -l)" -gt 40 ] || fail "few functions of other libraries are asked for"
for name in $names; do echo "int $name(void); int $name(void) { return 0; }"; done >"$folder/stubs.c"
musl-gcc -static -o "$folder/render-cli" "$folder/apps/cli.o" "$folder/libapps.a" "$folder/libbrume.a" "$folder/stubs.c" \
    -lm >"$folder/log" 2>&1 || { tail "$folder/log"; fail "render-cli does not link"; }
musl-gcc -static -std=c99 -D_POSIX_C_SOURCE=200809L -Wall -Wextra -Werror -Itest/mingw -Ilib -o "$folder/test_platform" \
    test/test_platform.c lib/platform_posix.c lib/file_replace.c || fail "test_platform is not built"

rm -rf "$folder"/test_platform-*
BRUME_BUILD=$folder "$folder/test_platform" >"$folder/out" || { cat "$folder/out"; fail "test_platform fails on musl"; }
[ "$(grep -c ': ok$' "$folder/out")" -eq "$(grep -c 'cmocka_unit_test(' test/test_platform.c)" ] ||
    fail "test_platform ran other tests than expected"
[ "$("$folder/render-cli" --version)" = "$("$build/render-cli" --version)" ] || fail "--version says something else"
[ "$("$folder/render-cli" --help)" = "$("$build/render-cli" --help)" ] || fail "--help says something else"
"$folder/render-cli" --list-devices >/dev/null 2>&1
[ $? -eq 4 ] || fail "without a device the exit code is not 4"
echo "check-musl: built, and started"
