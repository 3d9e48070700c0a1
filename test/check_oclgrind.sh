# check_oclgrind.sh BUILD SCENE... -- small renders inside Oclgrind, which watches every access of the kernels to
# memory: out of bounds, misaligned, racing, and, in a scene that calls for every part of the kernels, of values that
# were never set. A picture of a few pixels takes seconds there. Oclgrind has no vector any() tricks to fear, so 1 and 4
# lanes stand for all widths.
build=$1
shift
if ! command -v oclgrind >/dev/null 2>&1; then
    echo "check-oclgrind: oclgrind is not installed (Debian: apt install oclgrind)" >&2
    exit 1
fi
status=0
folder=$(mktemp -d)

# judge NAME CODE: what is in the log.
judge() {
    if [ "$2" -ne 0 ] || grep -q -E 'Invalid|race|Misaligned|error|FATAL|ninitialized' "$folder/log"; then
        echo "check-oclgrind: $1: exit status $2" >&2
        head -n 20 "$folder/log" >&2
        status=1
    else
        echo "check-oclgrind: $1: clean"
    fi
}

for scene; do
    for lanes in 1 4; do
        oclgrind --build-options "-cl-opt-disable -DFN=static" --data-races --check-api \
            "$build/render-cli" "$scene" -o "$folder/a.exr" -o "$folder/a.png" -q --crop 0,6,0,4 --spp 1 \
            --lanes $lanes >"$folder/log" 2>&1
        judge "$scene, $lanes lanes" $?
    done
done

# Memory filled by clEnqueueFillBuffer counts as never set, so the fill is made a write, by a library that has to come
# before Oclgrind's; `oclgrind` itself would not have that.
everything() {
    lanes=$1
    shift
    OCLGRIND_UNINITIALIZED=1 OCLGRIND_DATA_RACES=1 OCLGRIND_CHECK_API=1 \
        OCLGRIND_BUILD_OPTIONS="-cl-opt-disable -DFN=static" LD_PRELOAD="$build/fill_buffer.so $runtime" \
        "$build/render-cli" "$folder/everything.xml" -o "$folder/b.exr" -q --layers all --spp 1 --lanes "$lanes" \
        "--stats=json:$folder/stats" "$@" >"$folder/log" 2>&1
    code=$?
    grep -q 'Oclgrind' "$folder/stats" || echo "error: this is not Oclgrind" >>"$folder/log"
    grep -q '"features_left_out":\[\]' "$folder/stats" || echo "error: the scene leaves out features" >>"$folder/log"
    judge "everything, $lanes lanes $*" $code
}
sh "$(dirname "$0")/oclgrind/everything.sh" "$folder"
prefix=$(dirname "$(dirname "$(command -v oclgrind)")")
runtime=$(find "$prefix/lib" "$prefix/lib64" -name liboclgrind-rt.so 2>/dev/null | head -n 1)
if [ -n "$runtime" ]; then
    everything 1
    everything 4
    everything 4 --strategy raster --indirect mixture
else
    echo "check-oclgrind: no liboclgrind-rt.so below $prefix: values never set are not looked for" >&2
    status=1
fi
rm -rf "$folder"
exit $status
