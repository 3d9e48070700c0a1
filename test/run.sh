# run.sh BUILD PROGRAM... -- runs the test programs (cmocka, TAP), shows what fails, and closes with the counts.
# Fails if a test failed, a program died, or nothing ran on an OpenCL device.
build=$1
shift
passed=0 failed=0 skipped=0
device=$("$build/render-cli" --list-devices 2>/dev/null | head -n 1)
echo "device: ${device:-none}"
for program; do
    name=${program##*/}
    start=$(date +%s)
    CMOCKA_MESSAGE_OUTPUT=TAP BRUME_BUILD=$build timeout 1200 "$program" >"$build/$name.tap" 2>"$build/$name.err"
    code=$?
    p=$(grep -c '^ok' "$build/$name.tap")
    s=$(grep -c '^ok.*# SKIP' "$build/$name.tap")
    f=$(grep -c '^not ok' "$build/$name.tap")
    if [ $code -ne 0 ] && [ "$f" -eq 0 ]; then f=1; fi
    passed=$((passed + p - s)) skipped=$((skipped + s)) failed=$((failed + f))
    printf '%-28s %4d passed %3d failed %3d skipped %5d s\n' "$name" $((p - s)) "$f" "$s" $(($(date +%s) - start))
    grep '^ok.*# SKIP' "$build/$name.tap"
    if [ "$f" -gt 0 ]; then
        echo "  exit status $code"
        grep -A 20 '^not ok' "$build/$name.tap"
        tail -n 40 "$build/$name.err"
    fi
done
if [ -z "$device" ]; then
    echo "no OpenCL device: nothing was rendered"
    failed=$((failed + 1))
fi
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
