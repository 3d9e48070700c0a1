# check_oclgrind.sh BUILD SCENE... -- small renders inside Oclgrind, which watches every access of the kernels to memory:
# out of bounds, misaligned, racing. A picture of a few pixels takes seconds there. Oclgrind has no vector any() tricks to
# fear, so 1 and 4 lanes stand for all widths. (Its check for uninitialised values is left out: Oclgrind 21.10 takes
# clEnqueueFillBuffer for no initialisation.)
build=$1
shift
if ! command -v oclgrind >/dev/null 2>&1; then
    echo "check-oclgrind: oclgrind is not installed (Debian: apt install oclgrind)" >&2
    exit 1
fi
status=0
folder=$(mktemp -d)
for scene; do
    for lanes in 1 4; do
        oclgrind --build-options "-cl-opt-disable -DFN=static" --data-races --check-api \
            "$build/render-cli" "$scene" -o "$folder/a.exr" -q --crop 0,6,0,4 --spp 1 --lanes $lanes \
            >"$folder/log" 2>&1
        code=$?
        if [ $code -ne 0 ] || grep -q -E 'Invalid|race|Misaligned|error|FATAL' "$folder/log"; then
            echo "check-oclgrind: $scene, $lanes lanes: exit status $code" >&2
            head -n 20 "$folder/log" >&2
            status=1
        else
            echo "check-oclgrind: $scene, $lanes lanes: clean"
        fi
    done
done
rm -rf "$folder"
exit $status
