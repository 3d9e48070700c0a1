# check_help.sh MAKE README MAKEFILE... -- `make help` lists every target that is meant to be named, and only these; the
# README names no other.
make=$1 readme=$2
shift 2
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
broken=0

"$make" -s help | sed -n 's/^  make \([a-z0-9-]*\) .*/\1/p' | sort > "$folder/listed"
# What a target of these makes for itself has no line.
sed -e ':more' -e '/\\$/{N;s/\\\n//;b more' -e '}' "$@" | sed -n 's/^\.PHONY://p' | tr -s ' \t' '\n\n' |
    grep -v -x -e '' -e fuzzers -e threads-checked | sort > "$folder/targets"
diff "$folder/listed" "$folder/targets" > "$folder/differences" || {
    echo "make help and the .PHONY targets differ (< listed, > there):"
    grep '^[<>]' "$folder/differences"
    broken=1
}
[ "$(wc -l < "$folder/listed")" -gt 20 ] || { echo "make help lists next to nothing"; broken=1; }

# In the README `make name`, or make with several names in a block of commands; without variables and what is optional.
sed -n -e 's/^    make \(.*\)/\1/p' "$readme" | sed 's/#.*//' > "$folder/words"
grep -o '`make [^`]*`' "$readme" | sed -e 's/`make \(.*\)`/\1/' >> "$folder/words"
sed 's/"[^"]*"//g' "$folder/words" | tr ' ' '\n' | grep -x '[a-z][a-z0-9-]*' | sort -u > "$folder/named"
comm -23 "$folder/named" "$folder/listed" > "$folder/unknown"
[ -s "$folder/named" ] || { echo "$readme names no target"; broken=1; }
if [ -s "$folder/unknown" ]; then
    echo "$readme names targets that make help does not list:" $(cat "$folder/unknown")
    broken=1
fi
[ $broken -eq 0 ] && echo "check-help: $(wc -l < "$folder/listed") targets, $(wc -l < "$folder/named") of them in $readme"
exit $broken
