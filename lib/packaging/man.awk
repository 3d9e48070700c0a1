# man.awk -- lib/brume.h as manual pages: brume.3 for what stands before its first heading, brume-NAME.3 for each group
# below one, and for every function a page that leads to its group's.
#     awk -v out=FOLDER -v version=0.1.0 -v date=2026-11-30 -f roff.awk -f man.awk brume.h
# Comments at the margin become paragraphs; declarations stay as they are, with the comments inside them.

# Prototypes of a group go before its text: both are kept until its end.
function begin_group(page, what) {
    end_group()
    name = page; about = what; body = ""; synopsis = ""; functions = 0
}

function end_group(    file, i) {
    if (name == "") return
    file = out "/" name ".3"
    printf ".\\\" Made from brume.h.\n.TH %s 3 %s \"brume %s\" \"brume\"\n.SH NAME\n", name, date, version > file
    printf "%s \\- %s\n", name, escape(about) > file
    printf ".SH SYNOPSIS\n.nf\n#include <brume.h>\n" > file
    if (synopsis != "") printf ".PP\n%s", synopsis > file
    sub(/^.PP\n/, "", body)
    printf ".fi\n.SH DESCRIPTION\n%s", body > file
    pages[++page_count] = file
    page_names[page_count] = name
    close(file)
    for (i = 1; i <= functions; i++) {
        file = out "/" function_names[i] ".3"
        printf ".so man3/%s.3\n", name > file
        close(file)
    }
}

function add(text) { body = body text "\n" }

# One line of a comment at the margin, without its stars.
function say(text) {
    if (text ~ /^    /) {
        if (!example) add(".PP\n.RS 4\n.EX")
        example = 1
        add(escape(substr(text, 5)))
        return
    }
    if (example) add(".EE\n.RE")
    example = 0
    if (text == "") { add_break = 1; return }
    if (text ~ /^ - /) {
        add(".IP \\(bu 3")
        text = substr(text, 4)
    } else if (add_break) {
        add(".PP")
    }
    add_break = 0
    sub(/^ +/, "", text)
    add(escape(text))
}

function begin_comment() { add_break = 1; example = 0 }
function end_comment() { if (example) add(".EE\n.RE"); example = 0 }

# A declaration, or the part of one that a line holds.
function begin_code() { if (!code) add(".PP\n.nf\n.RS 2"); code = 1 }
function end_code() { if (code) add(".RE\n.fi"); code = 0; prototype = 0 }

function count(text, what,    n) { n = gsub(what, "", text); return n }

BEGIN { begin_group("brume", "renderer for light in fog") }

/^\/\* ---- / {
    end_code()
    title = $0
    gsub(/^\/\* -+ | *-+ \*\/$/, "", title)
    page = title
    sub(/:.*/, "", page)
    gsub(/[^a-z]+/, "-", page)
    begin_group("brume-" page, title)
    next
}

# Guards, includes and what differs between compilers are nobody's business.
/^#ifndef BRUME_H/ || /^#define BRUME_H/ || /^#include/ { next }
/^#if/ { hidden++ }
hidden { if (/^#endif/) hidden--; next }
/^#endif/ { next }

!code && /^\/\*/ {
    in_comment = 1
    begin_comment()
    text = $0
    sub(/^\/\* ?/, "", text)
    if (text ~ /^brume\.h -- /) next
    if (sub(/ *\*\/$/, "", text)) in_comment = 0
    say(text)
    if (!in_comment) end_comment()
    next
}
in_comment {
    text = $0
    if (sub(/ *\*\/$/, "", text)) in_comment = 0
    sub(/^ \*? ?/, "", text)
    if (text != "" || in_comment) say(text)
    if (!in_comment) end_comment()
    next
}

/^$/ && !depth { end_code(); next }

{
    begin_code()
    # A prototype right below a struct or another prototype may have a comment of its own.
    text = $0
    if (sub(/^BRUME_API /, "", text)) {
        prototype = 1
        if (match(text, /brume_[a-z0-9_]*\(/)) function_names[++functions] = substr(text, RSTART, RLENGTH - 1)
    } else if (prototype) {
        sub(/^ +/, "    ", text)
    }
    add(escape(text))
    if (prototype) synopsis = synopsis escape(text) "\n"
    if (prototype && text ~ /;$/) prototype = 0
    depth += count($0, "{") - count($0, "}")
}

END {
    end_code()
    end_group()
    for (i = 1; i <= page_count; i++) {
        printf ".SH SEE ALSO\n.BR render\\-cli (1)" >> pages[i]
        for (j = 1; j <= page_count; j++)
            if (j != i) printf ",\n.BR %s (3)", escape(page_names[j]) >> pages[i]
        printf "\n" >> pages[i]
        close(pages[i])
    }
}
