# embed.sh FILE... -- the files as C string literals: the array brume_sources of program.h. Literals are cut into pieces
# of one line each, because C99 promises only 4095 characters for a whole one and compilers join pieces without limit.
printf '#include "program.h"\n\n'
printf '#if defined(__GNUC__)\n#pragma GCC diagnostic ignored "-Woverlength-strings"\n#endif\n\n'
printf 'const brume_source brume_sources[] = {\n'
for file; do
    printf '    {"%s",\n' "${file##*/}"
    sed -e 's/\\/\\\\/g' -e 's/"/\\"/g' -e 's/^/     "/' -e 's/$/\\n"/' "$file"
    printf '    },\n'
done
printf '    {0, 0}\n};\n'
