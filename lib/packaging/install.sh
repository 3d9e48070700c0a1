# install.sh install|uninstall BUILD -- puts what BUILD holds into $DESTDIR/$prefix, or takes it away again: one list for
# both. From the environment: DESTDIR, prefix, bindir, libdir, includedir, mandir, datadir, version, shared (the name
# that programs load), linked (the one they link), static_libraries (what the static library needs, with ; between).
action=$1 build=$2
set -e

# put SOURCE TARGET MODE
put() {
    if [ "$action" = uninstall ]; then
        rm -f "$DESTDIR$2"
    else
        mkdir -p "$(dirname "$DESTDIR$2")"
        cp "$1" "$DESTDIR$2.new" && chmod "$3" "$DESTDIR$2.new" && mv -f "$DESTDIR$2.new" "$DESTDIR$2"
    fi
}

# point TARGET NAME: a link beside its target
point() {
    if [ "$action" = uninstall ]; then rm -f "$DESTDIR$2"; else ln -sf "$1" "$DESTDIR$2"; fi
}

# From a template, with @names@ filled in.
fill() {
    [ "$action" = uninstall ] || sed -e "s|@prefix@|$prefix|g; s|@libdir@|$libdir|g; s|@includedir@|$includedir|g" \
        -e "s|@version@|$version|g; s|@shared@|$shared|g; s|@static_libraries@|$static_libraries|g" \
        -e "s|@includedir_from_cmake@|$includedir_from_cmake|g" "lib/packaging/${1##*/}.in" >"$build/${1##*/}"
    put "$build/${1##*/}" "$1" 644
}

# Up from libdir/cmake/brume to the prefix, and down: so that the tree can be moved.
case $libdir in
    "$prefix"/*) includedir_from_cmake=$(echo "${libdir#"$prefix"/}/cmake/brume" | sed 's|[^/][^/]*|..|g') ;;
    *) includedir_from_cmake= ;;
esac
case $includedir in
    "$prefix"/*) [ -z "$includedir_from_cmake" ] || includedir_from_cmake=$includedir_from_cmake/${includedir#"$prefix"/} ;;
    *) includedir_from_cmake= ;;
esac
includedir_from_cmake=${includedir_from_cmake:-$includedir}

put lib/brume.h "$includedir/brume.h" 644
put "$build/libbrume.a" "$libdir/libbrume.a" 644
case $shared in
    *.so.*)
        put "$build/$shared" "$libdir/$linked.$version" 755
        point "$linked.$version" "$libdir/$shared"
        point "$shared" "$libdir/$linked" ;;
    *.dylib)
        put "$build/$shared" "$libdir/$shared" 755
        point "$shared" "$libdir/$linked" ;;
    *.dll)
        put "$build/$shared" "$bindir/$shared" 755
        put "$build/$linked" "$libdir/$linked" 644 ;;
esac
fill "$libdir/pkgconfig/brume.pc"
fill "$libdir/cmake/brume/brume-config.cmake"
fill "$libdir/cmake/brume/brume-config-version.cmake"
put "$build/render-cli" "$bindir/render-cli" 755
put "$build/man/render-cli.1" "$mandir/man1/render-cli.1" 644
for page in "$build"/man/*.3; do put "$page" "$mandir/man3/${page##*/}" 644; done
put "$build/completions/render-cli.bash" "$datadir/bash-completion/completions/render-cli" 644
put "$build/completions/render-cli.zsh" "$datadir/zsh/site-functions/_render-cli" 644
put "$build/completions/render-cli.fish" "$datadir/fish/vendor_completions.d/render-cli.fish" 644
put LICENSE "$datadir/doc/brume/LICENSE" 644
if [ "$action" = uninstall ]; then
    rmdir "$DESTDIR$libdir/cmake/brume" "$DESTDIR$datadir/doc/brume" 2>/dev/null || :
fi
