# check_study.sh BUILD -- a small study, its figures against numpy and NVIDIA's FLIP (both from PyPI, in a virtual
# environment in BUILD), and its page in headless Chromium: no error, no request, screenshots to look at.
# Exit status 0: all held; 1: something didn't; 77: what was needed to check isn't there.
build=$1
out=$build/study-check
here=${0%/*}
mkdir -p "$out"
skipped=0 failed=0

echo "== a study"
"$build/render-cli" study scenes/three-spots.xml -o "$out/study" --width 96 --budget 40 --fresh -q || exit 1

echo "== figures"
if [ ! -x "$out/venv/bin/python" ]; then
    python3 -m venv "$out/venv" || rm -rf "$out/venv"
fi
if [ -x "$out/venv/bin/python" ] &&
    "$out/venv/bin/python" -m pip install -q --disable-pip-version-check -r "$here/requirements.txt"; then
    "$out/venv/bin/python" "$here/check_figures.py" "$out/study" --require-flip || failed=1
else
    echo "skipped: no virtual environment (Debian: python3-venv), or no packages from PyPI"
    skipped=1
fi

echo "== the page"
browser=
for name in chromium chromium-browser google-chrome; do
    command -v $name >/dev/null 2>&1 && browser=$name && break
done
if [ -z "$browser" ]; then
    echo "skipped: no chromium; make check-study browser=1 installs it"
    skipped=1
fi

# browse FILE PICTURE WIDTH HEIGHT [OPTION]: what the page made the browser say, and what it asked the network for. The
# proxy is a closed port, so that nothing gets out; what the browser asks for itself is its maker's and doesn't count.
browse() {
    rm -f "$2" "$out/net.json"
    $browser --headless=new --no-sandbox --disable-gpu --hide-scrollbars --disable-background-networking \
        --disable-component-update --user-data-dir="$out/profile" --proxy-server=127.0.0.1:9 --enable-logging=stderr \
        --log-net-log="$out/net.json" --window-size="$3,$4" --screenshot="$2" $5 "file://$(realpath "$1")" 2>&1 |
        grep 'CONSOLE'
    tr ',' '\n' <"$out/net.json" | grep -o '"url":"http[^"]*"' |
        grep -v '//[^/]*\(google\|googleapis\|gvt1\)\.com' | sort -u
}

if [ -n "$browser" ]; then
    # What is looked for must show where it is.
    printf '<!doctype html><img src="http://example.com/a.png"><script>nothing()</script>' >"$out/planted.html"
    said=$(browse "$out/planted.html" "$out/planted.png" 500 200)
    case "$said" in
        *CONSOLE*example.com*) ;;
        *) echo "FAILED: an error and a request that were planted went unnoticed: $said"
           failed=1 ;;
    esac
    for picture in desk.png:1280:4200: phone.png:500:3000: dark.png:1280:2000:--force-dark-mode; do
        size=${picture#*:}
        name=${picture%%:*} width=${size%%:*} rest=${size#*:}
        said=$(browse "$out/study/study.html" "$out/$name" "$width" "${rest%%:*}" "${rest#*:}")
        if [ -n "$said" ]; then
            echo "FAILED: $name: $said"
            failed=1
        elif [ "$(wc -c <"$out/$name" 2>/dev/null || echo 0)" -lt 20000 ]; then
            echo "FAILED: $name: no screenshot, or an empty one"
            failed=1
        else
            echo "$out/$name: no errors, no requests; look at it"
        fi
    done
fi
[ $failed -eq 0 ] || exit 1
[ $skipped -eq 0 ] || exit 77
