# check_cl.sh ENTRY.cl... -- every kernel entry point through clang as OpenCL C 1.2, at each width and precision, with
# all features, with few and with none, and with the estimators that differ most. Needs no OpenCL device.
status=0
count=0
for entry; do
    for lanes in 1 4 8 16; do
        for precision in "" -DBRUME_DOUBLE; do
            for features in 0 'FEATURE_MEDIA|FEATURE_DELTA_LIGHTS|FEATURE_SCATTERING' FEATURE_ALL; do for strategy in 0 1 2 5 7; do
                clang -x cl -cl-std=CL1.2 -Xclang -finclude-default-header -target spir64-unknown-unknown \
                    -fsyntax-only -Wall -Wextra -Wno-unused-function -Werror -Icl -DBRUME_DEVICE=1 \
                    -DLANES=$lanes -DFEATURES="($features)" -DSTRATEGY=$strategy $precision "$entry" || {
                    echo "check-cl: $entry lanes=$lanes $precision features=$features strategy=$strategy" >&2
                    status=1
                }
                count=$((count + 1))
            done; done
        done
    done
done
echo "check-cl: $count builds of $# entry points"
[ "$count" -gt 0 ] || status=1
exit $status
