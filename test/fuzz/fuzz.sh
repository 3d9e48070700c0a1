# fuzz.sh BUILD SECONDS [RUNS] -- each reader of files by libFuzzer for so many seconds, from the files that
# test/fuzz/seeds.c writes and what earlier runs kept in BUILD/corpus. An input that a reader doesn't survive goes to
# test/fuzz/found/, which test_hostile reads again ever after. With RUNS it is so many readings instead, the same every
# time, from the first files alone; an input that is not survived goes to BUILD/found/, and the tree stays as it is. Ends
# with a line for each: readings, and how many were not survived.
build=$1 seconds=$2 runs=$3 lost=0 still=
corpora=$build/corpus kept=test/fuzz/found until=-max_total_time=$seconds
if [ -n "$runs" ]; then
    # What values are compared with (use_cmp), names of temporary files and addresses, would differ from run to run.
    corpora=$build/corpus-fixed kept=$build/found until="-seed=1 -runs=$runs -use_cmp=0"
    setarch -R true 2>/dev/null && still="setarch -R"
    rm -rf "$corpora"
fi
for program in "$build"/test/fuzz/fuzz_*; do
    case $program in *.o | *.d) continue ;; esac
    name=${program##*/fuzz_}
    corpus=$corpora/$name found=$kept/$name known=test/fuzz/found/$name
    mkdir -p "$corpus" "$found"
    FUZZ_SEEDS=$corpora "$program" || exit 1
    [ -d "$known" ] || known=
    log=$build/fuzz_$name.log
    # A length that fits what a reader can do in a second; memory as a picture of that length may ask for.
    $still "$program" $until -max_len=8192 -timeout=20 -rss_limit_mb=3000 -print_final_stats=1 \
        -artifact_prefix="$found/" "$corpus" $known >"$log" 2>&1
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
rmdir "$kept" 2>/dev/null
[ $lost -eq 0 ]
