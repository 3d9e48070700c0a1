# run.sh BUILD PROGRAM... -- runs the test programs (cmocka, TAP), shows what fails, and closes with the counts.
# Fails if a test failed, a program died, or there is no OpenCL device for anything to run on.
build=$1
shift
# Kernels come from source here, and the user's cache is not the tests' to fill.
export BRUME_CACHE_DIR=
passed=0 failed=0 skipped=0
device=$("$build/render-cli" --list-devices 2>/dev/null | head -n 1)
echo "device: ${device:-none}"
for program; do
    name=${program##*/}
    tap=$build/$name.tap
    start=$(date +%s)
    CMOCKA_MESSAGE_OUTPUT=TAP BRUME_BUILD=$build timeout 1200 "$program" >"$tap" 2>"$build/$name.err"
    code=$?
    # cmocka 1.1 writes a skipped test as "not ok 3 # SKIP name", others as "ok 3 - name # SKIP".
    p=$(grep -v '# SKIP' "$tap" | grep -c '^ok')
    s=$(grep -c '^[not ]*ok.*# SKIP' "$tap")
    f=$(grep -v '# SKIP' "$tap" | grep -c '^not ok')
    # A program that died, or ended before its plan, counts as one more failure.
    planned=$(sed -n 's/^1\.\.\([0-9]*\)$/\1/p' "$tap" | awk '{ n += $1 } END { print n + 0 }')
    if [ $((p + s + f)) -lt "$planned" ] || [ "$planned" -eq 0 ] || { [ $code -ne 0 ] && [ "$f" -eq 0 ]; }; then
        f=$((f + 1))
    fi
    passed=$((passed + p)) skipped=$((skipped + s)) failed=$((failed + f))
    printf '%-28s %4d passed %3d failed %3d skipped %5d s\n' "$name" "$p" "$f" "$s" $(($(date +%s) - start))
    sed -n 's/^[not ]*ok.*# SKIP *\(.*\)/    skipped: \1/p' "$tap"
    if [ "$f" -gt 0 ]; then
        echo "  exit status $code"
        grep -v '# SKIP' "$tap" | grep -A 20 '^not ok'
        tail -n 40 "$build/$name.err"
    fi
done
if [ -z "$device" ]; then
    echo "no OpenCL device: nothing was rendered"
    failed=$((failed + 1))
fi
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
