# check_readme.sh BUILD CC LIBS -- the README, taken at its word: its links lead somewhere, render-cli has the options it
# names, its scene is read without a warning and calls for what it is to show, and its C program compiles and renders
# that scene, or says what is wrong with it.
build=$1 cc=$2 libs=$3
readme=${README:-README.md}
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
broken=0

fail() {
    echo "check-readme: $*" >&2
    broken=$((broken + 1))
}
# block LANGUAGE: what stands between ```LANGUAGE and ```.
block() { sed -n "/^\`\`\`$1\$/,/^\`\`\`\$/p" "$readme" | sed '/^```/d'; }

# ---- links ----

sed 's/^#* *//; s/[^A-Za-z0-9 _-]//g; s/ /-/g' <<END | tr A-Z a-z | sort >"$folder/anchors"
$(grep '^##* ' "$readme")
END
tr '\n' ' ' <"$readme" | grep -o '\](  *[^)]*)\|\]([^)]*)' | sed 's/^](  *//; s/^](//; s/)$//' | sort -u >"$folder/links"
[ "$(wc -l <"$folder/links")" -gt 10 ] || fail "$readme has next to no links"
while read -r link; do
    case $link in
        http*) ;;
        \#*) grep -qxF "${link#?}" "$folder/anchors" || fail "no heading for $link" ;;
        *) [ -e "$link" ] || fail "no file $link" ;;
    esac
done <"$folder/links"

# ---- options, in the lines that call render-cli and in `--option ...` ----

for command in '' info effects study merge; do
    "$build/render-cli" $command --help
done | grep -o -- '--[a-z][a-z-]*' | sort -u >"$folder/options"
sed -n '/^## render-cli/,/^## /p' "$readme" | grep -o -- '[` ]--[a-z][a-z-]*' | tr -d '` ' | sort -u >"$folder/named"
[ "$(wc -l <"$folder/named")" -gt 15 ] || fail "$readme names next to no options"
for option in $(comm -13 "$folder/options" "$folder/named"); do
    fail "render-cli has no $option"
done

# ---- the scene ----

block xml >"$folder/full.xml"
# One picture element for ten, and one sample: it is the program that is tried.
sed 's/value="640"/value="64"/; s/value="480"/value="48"/; s/name="spp" value="[0-9]*"/name="spp" value="1"/' \
    "$folder/full.xml" >"$folder/fog.xml"
cmp -s "$folder/full.xml" "$folder/fog.xml" && fail "the scene's size is not where it is looked for"
printf 'v %s\n' '-.5 0 -.5' '.5 0 -.5' '0 0 .5' '0 1 0' >"$folder/mesh.obj"
printf 'f %s\n' '1 2 3' '1 4 2' '2 4 3' '3 4 1' >>"$folder/mesh.obj"
"$build/render-cli" info "$folder/full.xml" >"$folder/info" 2>"$folder/errors" || fail "the scene: $(cat "$folder/errors")"
[ -s "$folder/errors" ] && fail "the scene: $(cat "$folder/errors")"
for effect in scattering anisotropy beam-shadows spot-lights; do
    grep -q "^  $effect " "$folder/info" || fail "the scene doesn't call for $effect"
done

# ---- the program ----

block c >"$folder/viewer.c"
if $cc -std=c99 -pedantic-errors -Wall -Wextra -Werror -Ilib "$folder/viewer.c" "$build/libbrume.a" $libs \
    -o "$folder/viewer"; then
    (cd "$folder" && ./viewer) || fail "the program fails"
    [ -s "$folder/fog.exr" ] || fail "the program writes no picture"
    sed -i 's/type="spot"/type="spt"/' "$folder/fog.xml"
    said=$(cd "$folder" && ./viewer 2>&1) && fail "the program doesn't notice a wrong scene"
    case $said in
        *fog.xml:*:*spot*) ;;
        *) fail "the program says of a wrong scene: $said" ;;
    esac
else
    fail "the program doesn't compile"
fi

[ $broken -eq 0 ] && echo "check-readme: links, options, scene and program hold"
[ $broken -eq 0 ]
