# check_abi.sh BASE MAKE CC -- what a program that was compiled against the library of the commit BASE would find in this
# one: symbols, types and layouts by abidiff (abigail-tools). Additions are fine; for anything else the number in the
# SONAME (`abi` in the Makefile) has to be another. BASE empty: the last tag.
base=$1 make=$2 CC=$3
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT

command -v abidiff >/dev/null || { echo "check-abi: SKIPPED: no abidiff"; exit 77; }
[ -n "$base" ] || base=$(git describe --tags --abbrev=0 2>/dev/null) || {
    echo "check-abi: there is no tag: BASE=COMMIT says what to compare with" >&2
    exit 1
}
commit=$(git rev-parse --verify --quiet "$base^{commit}") || { echo "check-abi: no commit $base" >&2; exit 1; }

# library TREE: builds its shared library with what a debugger knows; prints the path.
library() {
    name=libbrume.so.$(sed -n 's/^abi := *//p' "$1/Makefile")
    case $name in *.) name=${name}0 ;; esac
    # The kernels and the level of optimisation change no interface.
    "$make" -s -C "$1" CC="$CC" CFLAGS='-g -O0' CXXFLAGS='-g -O0' build="$folder/build-$2" "$folder/build-$2/$name" \
        >"$folder/log" 2>&1 || { tail "$folder/log" >&2; return 1; }
    echo "$folder/build-$2/$name"
}

mkdir "$folder/base" "$folder/public-base" "$folder/public-now"
git archive "$commit" | tar -x -C "$folder/base"
then=$(library "$folder/base" base) && now=$(library . now) || { echo "check-abi: not built" >&2; exit 1; }
cp "$folder/base/lib/brume.h" "$folder/public-base"
cp lib/brume.h "$folder/public-now"
# Only what brume.h declares is public: with the folders of the headers, the rest of a type is private.
abidiff --headers-dir1 "$folder/public-base" --headers-dir2 "$folder/public-now" --no-added-syms "$then" "$now" >"$folder/report"
code=$?
if [ $((code & 3)) -ne 0 ]; then
    cat "$folder/report"
    echo "check-abi: abidiff failed" >&2
    exit 1
fi
[ $code -eq 0 ] && { echo "check-abi: a program built against $base goes on with this library"; exit 0; }
cat "$folder/report"
[ "${then##*/}" != "${now##*/}" ] && { echo "check-abi: changed, and so has the SONAME: ${then##*/}, ${now##*/}"; exit 0; }
echo "check-abi: changed since $base: raise abi in the Makefile and BRUME_n in lib/exports.map" >&2
exit 1
