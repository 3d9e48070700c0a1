# fuzz.sh BUILD SECONDS -- each reader of files by libFuzzer for so many seconds, from the files that test/fuzz/seeds.c
# writes and what earlier runs kept in BUILD/corpus. An input that a reader doesn't survive goes to test/fuzz/found/,
# which test_hostile reads again ever after. Ends with a line for each: readings, and how many were not survived.
build=$1 seconds=$2 lost=0
for program in "$build"/test/fuzz/fuzz_*; do
    case $program in *.o | *.d) continue ;; esac
    name=${program##*/fuzz_}
    corpus=$build/corpus/$name found=test/fuzz/found/$name
    mkdir -p "$build/corpus" "$corpus" "$found"
    FUZZ_SEEDS=$build/corpus "$program" || exit 1
    log=$build/fuzz_$name.log
    # A length that fits what a reader can do in a second; memory as a picture of that length may ask for.
    "$program" -max_total_time="$seconds" -max_len=8192 -timeout=20 -rss_limit_mb=3000 -print_final_stats=1 \
        -artifact_prefix="$found/" "$corpus" "$found" >"$log" 2>&1
    code=$?
    units=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
    bad=0
    if [ $code -ne 0 ]; then
        bad=1
        grep -m 1 -A 12 'ERROR\|SUMMARY\|runtime error' "$log"
        tail -n 3 "$log"
    fi
    rmdir "$found" 2>/dev/null
    lost=$((lost + bad))
    printf 'trust\tReads of hostile files: %s\t%s\t%s\n' "$name" "${units:-0}" "$bad"
done
rmdir test/fuzz/found 2>/dev/null
[ $lost -eq 0 ]
