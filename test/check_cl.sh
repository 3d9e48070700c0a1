# check_cl.sh ENTRY.cl... -- every kernel entry point through clang as OpenCL C 1.2, at each width and precision, with
# all features, with few and with none, with the estimators that differ most, and writing paths down. Needs no OpenCL
# device.
status=0
count=0
check() {
    clang -x cl -cl-std=CL1.2 -Xclang -finclude-default-header -target spir64-unknown-unknown \
        -fsyntax-only -Wall -Wextra -Wno-unused-function -Werror -Icl -DBRUME_DEVICE=1 "$@" || {
        echo "check-cl: $*" >&2
        status=1
    }
    count=$((count + 1))
}
for entry; do
    for precision in "" -DBRUME_DOUBLE; do
        for features in 0 'FEATURE_MEDIA|FEATURE_DELTA_LIGHTS|FEATURE_SCATTERING' FEATURE_ALL; do
            for lanes in 1 4 8 16; do
                for strategy in 0 1 2 5 7; do
                    check -DLANES=$lanes -DFEATURES="($features)" -DSTRATEGY=$strategy $precision "$entry"
                done
            done
            check -DLANES=1 -DTRACE -DFEATURES="($features)" $precision "$entry"
        done
    done
done
echo "check-cl: $count builds of $# entry points"
[ "$count" -gt 0 ] || status=1
exit $status
