# check_completions.sh BUILD -- the completions of render-cli know the options that apps/cli_options.c knows, and the
# shells understand them. bash and fish are asked what they would offer; zsh reads its file. A shell that is not
# installed is named and skipped.
completions=$1/completions
help=$1/help.txt
bad=0
fail() {
    echo "check-completions: $*" >&2
    bad=$((bad + 1))
}
has() { command -v "$1" >/dev/null || { echo "check-completions: SKIPPED: no $1"; return 1; }; }

# What the table of the source names, and what the help of any command does.
table=$(sed -n 's/.*{[^,{]*, *\(0\|.[a-zA-Z].\), "\([a-z-]*\)",.*/\2/p' apps/cli_options.c | sort -u)
helped=$(sed -n 's/^  \(-[a-zA-Z],\|   \) --\([a-z-]*\).*/\2/p' "$help" | sort -u)
[ "$(echo "$table" | wc -l)" -gt 20 ] || fail "apps/cli_options.c has few options"
[ "$table" = "$helped" ] || fail "the help and apps/cli_options.c differ: $(echo "$table" "$helped" | tr ' ' '\n' | sort | uniq -u)"

# The long options of one command's help: "" for none.
options_of() {
    awk -v command="$1" '/^usage: / { on = $3 == command || (command == "" && $3 ~ /^SCENE/) }
        on && match($0, /^  (-[A-Za-z],|   ) --[a-z-]+/) { print substr($0, 7, RLENGTH - 6) }' "$help" | sort
}

# bash WORD...: what it offers for the last of the words behind render-cli.
in_bash() {
    bash -c 'source "$0"; COMP_WORDS=(render-cli "$@"); COMP_CWORD=$#; _render_cli; printf "%s\n" "${COMPREPLY[@]}"' \
        "$completions/render-cli.bash" "$@" 2>&1
}
expect() { # expect WHAT GOT
    [ "$1" = "$2" ] || fail "offered \"$(echo "$2" | tr '\n' ' ')\" instead of \"$(echo "$1" | tr '\n' ' ')\""
}

commands=$(sed -n 's/^usage: render-cli \([a-z]*\) \(SCENE\|FILE\).*/\1/p' "$help")
if has bash; then
    for command in "" $commands; do
        expect "$(options_of "$command")" "$(in_bash $command scene.xml -- | sort)"
        case $(options_of "$command" | wc -l) in [0-9]) fail "$command has few options" ;; esac
    done
    expect study "$(in_bash stu)"
    expect --noise-threshold "$(in_bash fog.xml --noi)"
    expect "auto
on
off" "$(in_bash fog.xml --adaptive "")"
    expect "equiangular
equiangular-cone" "$(in_bash fog.xml --strategy equi)"
    expect media,spot-lights "$(in_bash fog.xml --without media,sp)"
    expect README.md "$(in_bash READ)"
    expect "" "$(in_bash fog.xml --spp "")"
    expect 0 "$(PATH=$(cd "${help%/*}" && pwd):$PATH in_bash fog.xml --device "" | head -n 1)"
fi

if has fish; then
    # fish keeps files of its own in the home folder.
    home=$(cd "$completions" && pwd)/home
    in_fish() { HOME=$home fish --no-config -c "source $completions/render-cli.fish; complete -C '$1'" | cut -f 1; }
    for command in "" $commands; do
        expect "$(options_of "$command")" "$(in_fish "render-cli $command scene.xml --" | sed 's/=$//' | sort)"
    done
    expect "float double" "$(in_fish "render-cli fog.xml --precision " | sort -r | tr '\n' ' ' | sed 's/ $//')"
fi

if has zsh; then
    zsh -n "$completions/render-cli.zsh" || fail "zsh does not read its file"
    for option in $helped; do
        grep -q -- "--$option\\[" "$completions/render-cli.zsh" || fail "zsh: no --$option"
    done
fi

[ $bad -eq 0 ] && echo "check-completions: $(echo "$helped" | wc -l) options"
[ $bad -eq 0 ]
