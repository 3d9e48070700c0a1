# stability.sh BUILD PROGRAM... -- runs the tests that report rows (stability.h) and prints them as one table, then in
# short form: of each subject the row that comes nearest to its tolerance. Both also into BUILD/stability.md.
# Fails if a program did.
build=$1
shift
# Tests may work in folders of their own.
rows=$(mkdir -p "$build" && cd "$build" && pwd)/stability.tsv
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
    echo
    echo "| subject | rows | nearest to its tolerance | reference | unit | tolerance | worst |"
    echo "|---|--:|---|---|---|--:|--:|"
    awk -F '\t' '
        { near = $5 > 0 ? $6 / $5 : $6 > 0 ? 1e9 : -1; count[$1]++ }
        !($1 in most) || near > most[$1] { most[$1] = near; row[$1] = $2 "\t" $3 "\t" $4 "\t" $5 "\t" $6 }
        END { for (s in row) print s "\t" count[s] "\t" row[s] }' "$rows" |
        sort | sed 's/|/\\|/g; s/\t/ | /g; s/^/| /; s/$/ |/'
} >"$table"
cat "$table"
rm -f "$rows.log"
exit $failed
