# render-cli.awk -- the options of render-cli, as its --help prints them, for a manual page and the completions of three
# shells: one awk program, so that all four know the same options.
#     { render-cli --help; echo; render-cli info --help; ... } | awk -v what=man|bash|zsh|fish -v version=... -v date=... -f ...

function begin_command(line) {
    command = line ~ /^usage: render-cli SCENE/ ? "" : line
    sub(/^usage: render-cli /, "", command)
    sub(/ ?(SCENE|FILE).*/, "", command)
    commands[++command_count] = command
    usage[command] = line
    sub(/^usage: /, "", usage[command])
    state = "about"
}

# "  -o, --output FILE   text" or "      --spp N   text"
function begin_option(line,    rest) {
    n = ++option_count[command]
    letter[command, n] = line ~ /^  -/ ? substr(line, 4, 1) : ""
    rest = substr(line, 9)
    match(rest, /^[a-z-]+/)
    long[command, n] = substr(rest, 1, RLENGTH)
    rest = substr(rest, RLENGTH + 1)
    argument[command, n] = ""
    if (rest ~ /^ [^ ]/) {
        match(rest, /^ [^ ]+/)
        argument[command, n] = substr(rest, 2, RLENGTH - 1)
        rest = substr(rest, RLENGTH + 1)
    }
    sub(/^ +/, "", rest)
    help[command, n] = rest
}

/^usage: / { begin_command($0); next }
/^Other things to do/ { state = "others"; next }
/^  (-[A-Za-z],|   ) --[a-z]/ { state = "options"; begin_option($0); next }
state == "options" && /^ +[^ ]/ {
    sub(/^ +/, "")
    help[command, n] = help[command, n] " " $0
    next
}
state == "options" && /^[^ ]/ { state = "after" }
state == "about" && NF { about[command] = about[command] (about[command] == "" ? "" : " ") $0 }
state == "after" && NF { after[command] = after[command] (after[command] == "" ? "" : "\n") $0 }

END {
    if (command_count < 2) { print "render-cli.awk: no options in the input" > "/dev/stderr"; exit 1 }
    if (what == "man") man()
    else if (what == "bash") bash()
    else if (what == "zsh") zsh()
    else if (what == "fish") fish()
}

# ---- what an option's argument may be ----

# "media, absorption, {point,spot}-lights" -> one word each, with spaces between.
function expand(list,    before, inside, behind, parts, i, n, result) {
    while (match(list, /[a-z-]*\{[^}]*\}[a-z-]*/)) {
        inside = substr(list, RSTART, RLENGTH)
        before = inside; sub(/\{.*/, "", before)
        behind = inside; sub(/.*\}/, "", behind)
        sub(/^[^{]*\{/, "", inside); sub(/\}.*/, "", inside)
        n = split(inside, parts, ",")
        result = ""
        for (i = 1; i <= n; i++) result = result (i > 1 ? ", " : "") before parts[i] behind
        list = substr(list, 1, RSTART - 1) result substr(list, RSTART + RLENGTH)
    }
    gsub(/[ ,]+/, " ", list)
    sub(/^ /, "", list); sub(/ $/, "", list)
    return list
}

# The words that an argument is chosen from: those of a|b|c, or those that the help lists behind its first colon.
function words(c, i,    a, text) {
    a = argument[c, i]
    if (a ~ /^[a-z]+(\|[a-z]+)+$/) { gsub(/\|/, " ", a); return a }
    if (a ~ /^json/) return "json"
    if (a !~ /^(NAME|EFFECT)/ || a ~ /=/) return ""
    text = help[c, i]
    if (!sub(/^[^:]*: /, "", text)) return ""
    sub(/[;(].*/, "", text)
    return expand(text)
}

# file, folder, device, words or none
function kind(c, i,    a) {
    a = argument[c, i]
    if (a == "FILE") return "file"
    if (a == "DIR") return "folder"
    if (a ~ /^I\|NAME/) return "device"
    return words(c, i) != "" ? "words" : "none"
}

# Several words with commas between them.
function is_list(c, i) { return argument[c, i] ~ /,\.\.\.$/ }

function is_repeated(c, i) { return long[c, i] == "output" && argument[c, i] == "FILE" || long[c, i] == "define" }

function first_clause(text) {
    sub(/ ?[;(:].*/, "", text)
    return text
}

# ---- manual page ----

function man_options(c,    i) {
    for (i = 1; i <= option_count[c]; i++) {
        print ".TP"
        printf "%s\\fB\\-\\-%s\\fR", (letter[c, i] != "" ? "\\fB\\-" letter[c, i] "\\fR, " : ""), escape(long[c, i])
        print (argument[c, i] != "" ? " \\fI" escape(argument[c, i]) "\\fR" : "")
        print escape(help[c, i])
    }
}

function man(    i, k, c, lines, n) {
    printf ".\\\" Made from the help of render-cli.\n.TH render-cli 1 %s \"brume %s\" \"brume\"\n", date, version
    print ".SH NAME\nrender\\-cli \\- renders light in fog"
    print ".SH SYNOPSIS"
    for (k = 1; k <= command_count; k++)
        printf "%s%s\n", (k > 1 ? ".br\n" : ""), escape(usage[commands[k]])
    print ".SH DESCRIPTION"
    print escape(about[""])
    print ".SH OPTIONS"
    man_options("")
    for (k = 2; k <= command_count; k++) {
        c = commands[k]
        printf ".SH %s\n%s\n", toupper(c), escape(about[c])
        man_options(c)
    }
    print ".SH EXIT STATUS"
    n = split(after[""], lines, "\n")
    for (i = 1; i <= n; i++) print escape(lines[i])
    print ".SH ENVIRONMENT"
    print ".TP\n\\fBBRUME_CACHE_DIR\\fR\nthe folder of compiled programs; empty: none is kept (default: brume in the user's cache)"
    print ".TP\n\\fBBRUME_CL_DIR\\fR\na folder to read the kernels from, instead of those in the library"
    print ".SH SEE ALSO\n.BR brume (3)"
}

# ---- bash ----

function bash_case(c, i,    k) {
    k = kind(c, i)
    if (k == "none") return "COMPREPLY=()"
    if (k == "file") return "_render_cli_files"
    if (k == "folder") return "_render_cli_folders"
    if (k == "device") return "_render_cli_devices"
    return (is_list(c, i) ? "_render_cli_list" : "_render_cli_words") " '" words(c, i) "'"
}

function bash(    k, c, i, all) {
    print "# bash completion for render-cli, made from its help."
    print "_render_cli_words() { local IFS=$' \\n'; COMPREPLY=($(compgen -W \"$1\" -- \"$current\")); }"
    print "_render_cli_files() { local IFS=$'\\n'; compopt -o filenames 2>/dev/null; COMPREPLY=($(compgen -f -- \"$current\")); }"
    print "_render_cli_folders() { local IFS=$'\\n'; compopt -o filenames 2>/dev/null; COMPREPLY=($(compgen -d -- \"$current\")); }"
    print "_render_cli_devices() { _render_cli_words \"$(render-cli --list-devices 2>/dev/null | cut -d: -f1)\"; }"
    print "# Words with commas between them: the last one is completed."
    print "_render_cli_list() {"
    print "    local before=${current%\"${current##*,}\"} IFS=$' \\n'"
    print "    COMPREPLY=($(compgen -P \"$before\" -W \"$1\" -- \"${current##*,}\"))"
    print "    compopt -o nospace 2>/dev/null"
    print "}"
    print "_render_cli() {"
    print "    local current=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]}"
    printf "    case $command in "
    for (k = 2; k <= command_count; k++) printf "%s%s", (k > 2 ? " | " : ""), commands[k]
    print ") ;; *) command= ;; esac"
    print "    case \"$command $before\" in"
    for (k = 1; k <= command_count; k++) {
        c = commands[k]
        for (i = 1; i <= option_count[c]; i++) {
            if (argument[c, i] == "") continue
            printf "        '%s --%s'%s) %s; return ;;\n", c, long[c, i],
                   (letter[c, i] != "" ? " | '" c " -" letter[c, i] "'" : ""), bash_case(c, i)
        }
    }
    print "    esac"
    print "    case \"$command $current\" in"
    for (k = 1; k <= command_count; k++) {
        c = commands[k]
        all = ""
        for (i = 1; i <= option_count[c]; i++)
            all = all (i > 1 ? " " : "") "--" long[c, i] (letter[c, i] != "" ? " -" letter[c, i] : "")
        printf "        '%s -'*) _render_cli_words '%s'; return ;;\n", c, all
    }
    print "    esac"
    print "    _render_cli_files"
    printf "    [ \"$COMP_CWORD\" -eq 1 ] && COMPREPLY+=($(compgen -W '"
    for (k = 2; k <= command_count; k++) printf "%s%s", (k > 2 ? " " : ""), commands[k]
    print "' -- \"$current\"))"
    print "    return 0"
    print "}"
    print "complete -F _render_cli render-cli"
}

# ---- zsh ----

function zsh_quote(text) {
    gsub(/[\[\]:\\]/, "\\\\&", text)
    gsub(/'/, "'\\\\''", text)
    return text
}

function zsh_action(c, i,    k) {
    k = kind(c, i)
    if (k == "file") return "_files"
    if (k == "folder") return "_files -/"
    if (k == "device") return "{_values device ${(f)\"$(render-cli --list-devices 2>/dev/null | cut -d: -f1)\"}}"
    if (k == "words") return is_list(c, i) ? "{_values -s , " long[c, i] " " words(c, i) "}" : "(" words(c, i) ")"
    return " "
}

function zsh(    k, c, i, spec, tail) {
    print "#compdef render-cli"
    print "# Made from the help of render-cli."
    print "local -a options"
    printf "case ${words[2]} in\n"
    for (k = command_count; k >= 1; k--) {
        c = commands[k]
        printf "%s)\n    options=(\n", (c == "" ? "*" : c)
        for (i = 1; i <= option_count[c]; i++) {
            tail = "[" zsh_quote(first_clause(help[c, i])) "]"
            if (argument[c, i] != "") tail = tail ":" zsh_quote(argument[c, i]) ":" zsh_action(c, i)
            printf "        '%s--%s%s'\n", (is_repeated(c, i) ? "*" : ""), long[c, i], tail
            if (letter[c, i] != "")
                printf "        '%s-%s%s'\n", (is_repeated(c, i) ? "*" : ""), letter[c, i], tail
        }
        print "    ) ;;"
    }
    print "esac"
    printf "_arguments -s $options '1:scene or command:{_alternative \"commands:command:("
    for (k = 2; k <= command_count; k++) printf "%s%s", (k > 2 ? " " : ""), commands[k]
    print ")\" \"scenes:scene:_files -g \\\"*.xml(-.)\\\"\"}' '2:scene:_files -g \"*.xml(-.)\"'"
}

# ---- fish ----

function fish_quote(text) {
    gsub(/\\/, "\\\\", text)
    gsub(/'/, "\\'", text)
    return text
}

function fish(    k, c, i, j, key, others, line) {
    print "# fish completions for render-cli, made from its help."
    for (k = 2; k <= command_count; k++) others = others (k > 2 ? " " : "") commands[k]
    for (k = 2; k <= command_count; k++)
        printf "complete -c render-cli -n 'test (count (commandline -opc)) -eq 1' -a %s -d '%s'\n", commands[k],
               fish_quote(first_clause(about[commands[k]]))
    for (k = 1; k <= command_count; k++) {
        c = commands[k]
        for (i = 1; i <= option_count[c]; i++) {
            printf "complete -c render-cli -n '%s__fish_seen_subcommand_from %s' -l %s", (c == "" ? "not " : ""),
                   (c == "" ? others : c), long[c, i]
            if (letter[c, i] != "") printf " -s %s", letter[c, i]
            key = kind(c, i)
            if (argument[c, i] != "") printf "%s", (key == "file" ? " -r -F" : " -x")
            if (key == "folder") printf " -a '(__fish_complete_directories)'"
            if (key == "device") printf " -a '(render-cli --list-devices 2>/dev/null | string replace -r \": .*\" \"\")'"
            if (key == "words" && is_list(c, i))
                printf " -a '(__fish_append , (string split \" \" \"%s\"))'", words(c, i)
            else if (key == "words")
                printf " -a '%s'", words(c, i)
            printf " -d '%s'\n", fish_quote(first_clause(help[c, i]))
        }
    }
}
