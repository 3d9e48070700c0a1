# stability.sh BUILD PROGRAM... -- runs the tests that report rows (stability.h) and prints them as one table, also into
# BUILD/stability.md. Fails if a program did.
build=$1
shift
rows=$build/stability.tsv
table=$build/stability.md
rm -f "$rows"
failed=0
for program; do
    echo "${program##*/}" >&2
    BRUME_STABILITY=$rows BRUME_CACHE_DIR='' BRUME_BUILD=$build "$program" >"$rows.log" 2>&1 || {
        cat "$rows.log" >&2
        failed=1
    }
done
[ -s "$rows" ] && {
    echo "other runtimes" >&2
    sh "$(dirname "$0")/stability_platforms.sh" "$build" "$rows" || failed=1
}
[ -s "$rows" ] || { echo "no test reported a row" >&2; exit 1; }
{
    echo "| subject | case | reference | unit | tolerance | worst | where |"
    echo "|---|---|---|---|---|---|---|"
    sort -s -t "$(printf '\t')" -k 1,1 "$rows" | sed 's/|/\\|/g; s/\t/ | /g; s/^/| /; s/$/ |/'
} >"$table"
cat "$table"
rm -f "$rows.log"
exit $failed
