# check_pictures.sh BUILD [quick] -- pictures as other programs see them: an EXR with all layers, read by OpenEXR's module
# for Python and by oiiotool; and, unless it is to be quick, the denoiser, from a wheel of PyPI, by test_denoise.
# Exit status 0: all held; 1: something didn't; 77: what was needed to check isn't there.
build=$1 quick=$2
here=${0%/*}
out=$build/pictures-check
skipped=0 failed=0
mkdir -p "$out"
"$build/render-cli" scenes/one-spot.xml -D width=96 -D height=60 --spp 8 --layers all -o "$out/all.exr" -q || exit 1
"$build/render-cli" scenes/one-spot.xml -D width=96 -D height=60 --spp 1 --layers none -o "$out/none.exr" -q || exit 1

echo "== oiiotool"
if command -v oiiotool >/dev/null 2>&1; then
    # direct + indirect - picture, and the largest value of it
    for pair in direct:indirect surface:volume; do
        a=${pair%:*} b=${pair#*:}
        largest=$(oiiotool "$out/all.exr" --ch "R=$a.R,G=$a.G,B=$a.B" "$out/all.exr" --ch "R=$b.R,G=$b.G,B=$b.B" --add \
            "$out/all.exr" --ch R,G,B --absdiff --printstats | sed -n 's/.*Stats Max: *\([0-9.e-]*\).*/\1/p')
        echo "$a + $b: off by at most $largest"
        awk -v x="$largest" 'BEGIN { exit !(x != "" && x + 0 < 0.01) }' || failed=1
    done
    oiiotool --info -v "$out/none.exr" | grep -q 'channel list: R, G, B$' || { echo "FAILED: not R, G, B alone"; failed=1; }
else
    echo "skipped: no oiiotool (Debian: openimageio-tools)"
    skipped=1
fi

echo "== OpenEXR"
[ -x "$out/venv/bin/python" ] || python3 -m venv "$out/venv" || rm -rf "$out/venv"
# install PACKAGE: in the version that requirements.txt names
install() {
    [ -x "$out/venv/bin/python" ] &&
        "$out/venv/bin/python" -m pip install -q --disable-pip-version-check "$(grep "^$1==" "$here/requirements.txt")" ||
        { echo "skipped: no virtual environment (Debian: python3-venv), or no $1 from PyPI"; skipped=1; return 1; }
}
if install OpenEXR; then
    "$out/venv/bin/python" "$here/check_layers.py" "$out/all.exr" || failed=1
fi
if [ -z "$quick" ]; then
    echo "== denoiser"
    if install pyoidn; then
        folder=$("$out/venv/bin/python" -c 'import importlib.util, os
print(os.path.dirname(importlib.util.find_spec("pyoidn").origin))')
        said=$(BRUME_OIDN=$folder/oidn/lib "$build/test/test_denoise" 2>&1) || failed=1
        echo "$said"
        case $said in *SKIPPED*) echo "FAILED: the denoiser of the wheel was not found"; failed=1 ;; esac
    fi
fi
[ $failed -eq 0 ] || exit 1
[ $skipped -eq 0 ] || exit 77
