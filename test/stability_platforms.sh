# stability_platforms.sh BUILD ROWS -- appends to the table of `make stability` (stability.h) what other OpenCL runtimes
# make of the same samples as the default one, where they are at hand: the same bits. Fails if not.
build=$1
rows=$2
folder=$(mktemp -d)
log=$folder/log
failed=0

# row NAME REFERENCE WORST WHERE
row() {
    printf 'platform\t%s\t%s\tvalues that differ\t0\t%s\t%s\n' "$@" >>"$rows"
}

intel() {
    name="Intel's runtime for CPUs"
    [ -e "$build/intel/venv/lib/libintelocl.so" ] || {
        row "$name" "the same samples at one lane, by PoCL" "not at hand" "make check-intel installs it"
        return
    }
    sh test/check_intel.sh "$build" scenes/one-spot.xml >"$log" 2>&1 || {
        cat "$log" >&2
        failed=1
    }
    # scene, lanes, share that differs, ...
    row "$name" "the same samples at one lane, by PoCL" "$(awk '$3 ~ /%/ && $3 + 0 >= most { most = $3 + 0; all++ }
        END { print all ? most " %" : "none made" }' "$log")" "one-spot.xml, 1 and 8 lanes"
}

# Inside Oclgrind a picture of a few pixels takes seconds. What it says of memory and races counts as a difference.
oclgrind_row() {
    name="Oclgrind, width $1"
    command -v oclgrind >/dev/null 2>&1 || {
        row "$name" "the same samples" "not at hand" "Debian: oclgrind"
        return
    }
    set -- "$1" scenes/one-spot.xml -q --crop 0,6,0,4 --spp 1
    lanes=$1
    shift
    if BRUME_CACHE_DIR='' "$build/render-cli" "$@" --lanes 1 -o "$folder/a.exr" >"$log" 2>&1 &&
        oclgrind --build-options "-cl-opt-disable -DFN=static" --data-races --check-api \
            "$build/render-cli" "$@" --lanes "$lanes" -o "$folder/b.exr" >"$log" 2>&1 &&
        ! grep -q -E 'Invalid|race|Misaligned|error|FATAL' "$log"; then
        "$build/test/measure_difference" "$folder/a.exr" "$folder/b.exr" 0 >"$log" 2>&1 || failed=1
        row "$name" "the same samples at one lane, by the default device" "$(awk '{ print $1; exit }' "$log")" \
            "one-spot.xml, 6 x 4 pixels"
    else
        cat "$log" >&2
        row "$name" "the same samples" "fails" "one-spot.xml, 6 x 4 pixels"
        failed=1
    fi
}

intel
oclgrind_row 1
oclgrind_row 4
rm -rf "$folder"
exit $failed
