# roff.awk -- what the makers of manual pages share.

# Text as roff takes it for text, whatever it begins with.
function escape(text) {
    gsub(/\\/, "\\e", text)
    gsub(/-/, "\\-", text)
    sub(/^\./, "\\\\\\&.", text)
    sub(/^'/, "\\\\\\&'", text)
    return text
}
