# check_threads.sh BUILD CC CFLAGS LIBS -- test_threads under ThreadSanitizer, as it was built in BUILD; then with a race
# planted into one file of the library at a time, each of which is to be found.
build=$1 compiler=$2 flags=$3 libs=$4
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
bad=0
# Its memory map has no place for what the newest kernels' randomisation may choose.
fixed=$(command -v setarch >/dev/null && setarch -R true 2>/dev/null && echo "setarch -R")
export BRUME_CACHE_DIR= BRUME_BUILD=$build
export TSAN_OPTIONS="suppressions=test/threads.supp exitcode=66"

# run PROGRAM LOG: 0 quiet, 66 a race was reported, else the test's own failure
run() {
    $fixed timeout 900 "$1" >"$2" 2>&1
}

# Whether two accesses come close enough in time to be noticed is chance. As many runs have to be quiet as a planted race
# gets to be noticed in.
runs=5

for i in $(seq $runs); do
    run "$build/test/test_threads" "$folder/log"
    code=$?
    [ $code -eq 0 ] && continue
    head -c 20000 "$folder/log"
    echo "check-threads: run $i of test_threads ends with $code" >&2
    bad=1
    break
done

# plant FILE FROM TO: FROM stands in the file once.
plant() {
    [ "$(grep -cF -- "$2" "lib/$1")" -eq 1 ] || { echo "check-threads: lib/$1 holds not once: $2" >&2; bad=1; return; }
    awk -v from="$2" -v to="$3" '{ i = index($0, from); if (i) $0 = substr($0, 1, i - 1) to substr($0, i + length(from)) } 1' \
        "lib/$1" >"$folder/$1"
    # The object replaces the archive's of that name.
    cp "$build/libbrume.a" "$folder/libbrume.a"
    $compiler $flags -Ilib -c -o "$folder/${1%.c}.o" "$folder/$1" && ar r "$folder/libbrume.a" "$folder/${1%.c}.o" &&
        $compiler -fsanitize=thread -o "$folder/test_threads" "$build/test/test_threads.o" \
            $(ls "$build"/test/*.o | grep -v '/test_\|/measure_\|/header_') "$folder/libbrume.a" -lcmocka $libs ||
        { echo "check-threads: not built with: $3" >&2; bad=1; return; }
    tries=0
    : >"$folder/planted.log"
    until grep -q 'WARNING: ThreadSanitizer: data race' "$folder/planted.log" || [ $tries -eq $runs ]; do
        run "$folder/test_threads" "$folder/planted.log"
        code=$?
        tries=$((tries + 1))
    done
    if grep -q 'WARNING: ThreadSanitizer: data race' "$folder/planted.log"; then
        echo "check-threads: found, as planted in lib/$1: $3"
    else
        echo "check-threads: planted in lib/$1, not found (status $code): $3" >&2
        bad=1
    fi
}

# The cancel flag as if one thread used it; who waits for the wide program without an order; state of the whole process;
# and pieces of work, or groups of a film, that threads count off as if one did.
plant render_run.c '__atomic_store_n(&render->cancelled, 1, __ATOMIC_RELAXED)' 'render->cancelled = 1'
plant render_program.c '__atomic_store_n(&p->state, build_wide(p), __ATOMIC_RELEASE)' 'p->state = build_wide(p)'
plant parallel.c '__atomic_fetch_add(&j->next, 1, __ATOMIC_RELAXED)' 'j->next++'
plant crew.c '__atomic_load_n(&crew->job.next, __ATOMIC_RELAXED), take' 'crew->job.next, take'
plant context.c 'context->references = 1;' 'static int contexts; context->references = 1 + 0 * ++contexts;'

[ $bad -eq 0 ] && echo "check-threads: no race in test_threads, and every planted one found"
[ $bad -eq 0 ]
