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
    sed -n 's/.*"features_left_out":\[\([^]]*\)\].*/ \1 /p' "$folder/stats" | tr -d '"' | tr ',' ' ' >"$folder/left_out"
    cat "$folder/left_out" >>"$folder/masks"
}

# all LANES OPTION...: nothing may be left out.
all() {
    sh "$(dirname "$0")/oclgrind/everything.sh" "$folder"
    everything "$@"
    grep -q '[a-z]' "$folder/left_out" && echo "error: the scene leaves out features" >>"$folder/log"
    judge "everything, lanes $*" $code
}

# without FEATURE OPTION -- PART...: leaves that feature out at least. only FEATURE OPTION -- PART...: of the parts only
# these, which need it.
without() {
    sh "$(dirname "$0")/oclgrind/everything.sh" "$folder" $4
    everything 4 $2
    grep -q " $1 " "$folder/left_out" || echo "error: $1 is there" >>"$folder/log"
    judge "everything without $1" $code
}
only() {
    rest=
    for part in $parts; do
        case " $4 " in *" $part "*) ;; *) rest="$rest $part" ;; esac
    done
    sh "$(dirname "$0")/oclgrind/everything.sh" "$folder" $rest
    everything 4 $2
    grep -q " $1 " "$folder/left_out" && echo "error: $1 is not there" >>"$folder/log"
    judge "only $1" $code
}
parts="media scattering multiple-scattering emission chromatic anisotropy null quadrics specular textures delta-lights
    many-lights area-lights environment"

# Of every two features: one, both or none is left out.
pairs() {
    awk '{ for (i = 1; i <= NF; i++) names[$i] = 1; row[NR] = $0 }
        END {
            for (a in names) for (b in names) if (a < b) {
                all += 4
                for (r = 1; r <= NR; r++) seen[a, b, index(row[r], " " a " ") > 0, index(row[r], " " b " ") > 0] = 1
            }
            for (a in names) for (b in names) if (a < b) for (k = 0; k < 4; k++)
                if ((a, b, int(k / 2), k % 2) in seen) met++
                else missing = missing "; " (k < 2 ? "" : "no ") a " with " (k % 2 ? "no " : "") b
            printf "check-oclgrind: %d renders; of %d cases of two features, on or off, %d", NR, all, met
            print missing ? "; never " substr(missing, 3) : ""
        }' "$folder/masks"
}
prefix=$(dirname "$(dirname "$(command -v oclgrind)")")
runtime=$(find "$prefix/lib" "$prefix/lib64" -name liboclgrind-rt.so 2>/dev/null | head -n 1)
if [ -n "$runtime" ]; then
    all 1
    all 4
    all 4 --strategy raster --indirect mixture
    for part in media null quadrics delta-lights area-lights environment specular textures many-lights chromatic \
        scattering anisotropy; do
        without $part "" -- $part
    done
    without flights "" -- "multiple-scattering emission area-lights environment"
    without light-layers "--layers albedo" --
    without guides "--layers none" --
    for part in media null quadrics area-lights environment specular textures delta-lights; do
        only $part "--layers none" -- $part
    done
    only many-lights "--layers none" -- "delta-lights many-lights"
    only chromatic "--layers none" -- "media chromatic"
    only scattering "--layers none" -- "media scattering"
    only anisotropy "--layers none" -- "media scattering anisotropy"
    only flights "--layers none" -- "media scattering multiple-scattering"
    only guides "--layers albedo" --
    only light-layers "--layers all" --
    pairs
else
    echo "check-oclgrind: no liboclgrind-rt.so below $prefix: values never set are not looked for" >&2
    status=1
fi
rm -rf "$folder"
exit $status
