# check_mingw.sh BUILD MAKE -- the library and render-cli compiled for Windows by MinGW-w64, with warnings as errors,
# linked to a DLL and a program, and these started under Wine if that is there; test_platform runs there, too.
#
# Debian has no OpenCL, OpenEXR, expat, libjpeg or zlib for MinGW. Their headers are this system's, and the functions
# are stubs made here that return 0: what is checked is our own code, down to the names it asks for. Nothing is rendered.
build=$1 make=$2
folder=$build/mingw
cross=x86_64-w64-mingw32
for tool in $cross-gcc $cross-g++; do
    command -v $tool >/dev/null || { echo "check-mingw: SKIPPED: no $tool"; exit 77; }
done
fail() {
    echo "check-mingw: $*" >&2
    exit 1
}
mkdir -p "$folder/include" "$folder/lib" || exit 1

# Of this system's headers those, and nothing else: the C library's would be taken for Windows'.
for header in CL stb OpenEXR Imath tiny_obj_loader.h expat.h expat_external.h zlib.h zconf.h jpeglib.h jmorecfg.h \
    jerror.h; do
    [ -e /usr/include/$header ] || fail "no /usr/include/$header"
    ln -sfn /usr/include/$header "$folder/include/$header"
done
# libjpeg's settings differ between machines, and are where these are told apart.
for header in /usr/include/jconfig.h /usr/include/$(gcc -print-multiarch)/jconfig.h; do
    [ ! -e "$header" ] || ln -sfn "$header" "$folder/include/jconfig.h"
done

include=$(pwd)/$folder/include
build_cross() {
    "$make" -s CC=$cross-gcc build="$folder" CFLAGS="-Werror -I$include" CXXFLAGS="-Werror -I$include" \
        LDFLAGS="-L$(pwd)/$folder/lib -static-libgcc" "$@" >"$folder/log" 2>&1 || { tail -n 30 "$folder/log"; fail "not built: $*"; }
}
build_cross "$folder/libbrume.a"

# What it asks of the five libraries.
names=$($cross-nm -u "$folder/libbrume.a" | sed -n 's/^ *U \(cl[A-Z].*\|exr_.*\|compress2\|compressBound\|crc32\|jpeg_[a-zA-Z_]*\|XML_.*\)$/\1/p' | sort -u)
[ "$(echo "$names" | wc -l)" -gt 40 ] || fail "few functions of other libraries are asked for"
for name in $names; do echo "int $name(void); int $name(void) { return 0; }"; done >"$folder/stubs.c"
$cross-gcc -c -o "$folder/stubs.o" "$folder/stubs.c" || exit 1
for library in OpenCL OpenEXRCore expat jpeg z; do
    rm -f "$folder/lib/lib$library.a"
    $cross-ar rcs "$folder/lib/lib$library.a" "$folder/stubs.o" || exit 1
done

rm -f "$folder/render-cli" "$folder/render-cli.exe"
build_cross "$folder/libbrume-0.dll" "$folder/render-cli"
[ -f "$folder/render-cli.exe" ] || fail "no render-cli.exe"
# The DLL exports what brume.h declares.
sed -n 's/^BRUME_API .*\(brume_[a-z0-9_]*\)(.*/\1/p' lib/brume.h | sort >"$folder/declared"
$cross-objdump -p "$folder/libbrume-0.dll" | sed -n '/Ordinal\/Name Pointer/,$s/.*\(brume_[a-z0-9_]*\)$/\1/p' | sort >"$folder/exported"
diff "$folder/declared" "$folder/exported" || fail "the DLL's exports are not what brume.h declares"
$cross-gcc -std=c99 -Wall -Werror -Ilib -o "$folder/use_brume" test/install/use_brume.c "$folder/libbrume.dll.a" ||
    fail "a program does not link with the DLL"
$cross-gcc -std=c99 -D__USE_MINGW_ANSI_STDIO=1 -Wall -Wextra -Werror -Itest/mingw -Ilib -o "$folder/test_platform" \
    test/test_platform.c lib/platform_windows.c lib/file_replace.c || fail "test_platform is not built"

wine=$(command -v wine64 || command -v wine || ls /usr/lib/wine/wine64 2>/dev/null)
if [ -z "$wine" ]; then
    echo "check-mingw: built; SKIPPED: no wine to start it"
    exit 0
fi
export WINEPREFIX=$(pwd)/$folder/wine WINEDEBUG=-all WINEPATH="$(dirname "$($cross-gcc -print-file-name=libstdc++-6.dll)");$(
    dirname "$($cross-gcc -print-file-name=libwinpthread-1.dll)")" BRUME_BUILD=$folder HWLOC_SYNTHETIC=
on_windows() { timeout 300 "$wine" "$@" </dev/null 2>"$folder/err" | tr -d '\r'; }
rm -rf "$folder"/test_platform-*
on_windows "$folder/test_platform.exe" >"$folder/out"
# All of its tests but those that are not Windows'.
tests=$(sed '/#ifndef _WIN32/,/#endif/d' test/test_platform.c | grep -c 'cmocka_unit_test(')
[ "$(grep -c ': ok$' "$folder/out")" -eq "$tests" ] || { cat "$folder/out" "$folder/err"; fail "test_platform fails under Wine"; }
[ "$(on_windows "$folder/render-cli.exe" --version)" = "$("$build/render-cli" --version)" ] ||
    { cat "$folder/err"; fail "render-cli --version under Wine says something else"; }
[ "$(on_windows "$folder/render-cli.exe" --help)" = "$("$build/render-cli" --help)" ] || fail "render-cli --help differs"
timeout 300 "$wine" "$folder/render-cli.exe" --list-devices </dev/null >"$folder/out" 2>"$folder/err"
[ $? -eq 4 ] || { cat "$folder/out" "$folder/err"; fail "without a device the exit code is not 4"; }
echo "check-mingw: built, and started under Wine"
