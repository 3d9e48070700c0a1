# check_aarch64.sh BUILD MAKE -- render-cli built for 64-bit ARM and run there under qemu's user emulation, with the ARM
# PoCL, in a chroot below BUILD/aarch64; its pictures are to be those of this machine's to the bit. Needs root, apt, some
# 700 MB, and a few minutes: most of them go into compiling kernels under emulation.
#
# Packages are unpacked, not installed: none of their scripts run, and this system stays as it is.
build=$1 make=$2
folder=$build/aarch64
root=$folder/root
cross=aarch64-linux-gnu
fail() {
    echo "check-aarch64: $*" >&2
    exit 1
}
for tool in apt-get dpkg-deb $cross-gcc $cross-g++ qemu-aarch64-static; do
    command -v $tool >/dev/null || { echo "check-aarch64: SKIPPED: no $tool"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "check-aarch64: SKIPPED: chroot needs root"; exit 77; }

# ---- the ARM system ----

# Also where an earlier check did without libjpeg.
if [ ! -f "$folder/unpacked" ] || [ ! -f "$root/usr/include/$cross/jconfig.h" ]; then
    rm -rf "$folder"
    mkdir -p "$folder/state/lists/partial" "$folder/cache/archives/partial" "$root/tmp" || exit 1
    : >"$folder/status"
    here=$(pwd)/$folder
    arm_apt() {
        apt-get -q -y -o Dir::State="$here/state" -o Dir::State::status="$here/status" -o Dir::Cache="$here/cache" \
            -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o Debug::NoLocking=true "$@"
    }
    { arm_apt update && arm_apt --no-install-recommends --download-only install libc6-dev libstdc++6 libgcc-12-dev \
        pocl-opencl-icd ocl-icd-opencl-dev libopenexr-dev libexpat1-dev libjpeg62-turbo-dev \
        zlib1g-dev; } >"$folder/log" 2>&1 ||
        { tail "$folder/log"; fail "the packages are not to be had"; }
    for package in "$folder"/cache/archives/*.deb; do
        dpkg-deb -x "$package" "$root" || fail "$package"
    done
    rm -rf "$folder/cache" "$folder/state"
    cp "$(command -v qemu-aarch64-static)" "$root/usr/bin/" || exit 1
    # PoCL calls the linker as a process of its own, which the kernel does not know to emulate.
    cat >"$folder/ld.c" <<'C'
#include <unistd.h>
int main(int argc, char **argv)
{
    char *all[argc + 2];
    all[0] = "qemu-aarch64-static";
    all[1] = "/usr/bin/aarch64-linux-gnu-ld.bfd";
    for (int i = 1; i <= argc; i++)
        all[i + 1] = argv[i];
    execv("/usr/bin/qemu-aarch64-static", all);
    return 127;
}
C
    gcc -O1 -static -o "$folder/ld" "$folder/ld.c" || exit 1
    for name in ld $cross-ld; do
        rm -f "$root/usr/bin/$name" && cp "$folder/ld" "$root/usr/bin/$name" || exit 1
    done
    touch "$folder/unpacked"
fi

# ---- the program ----

libraries=/usr/lib/$cross/lapack:/usr/lib/$cross/blas
"$make" -s CC=$cross-gcc build="$folder/build" "$folder/build/render-cli" \
    CFLAGS="-idirafter $(pwd)/$root/usr/include/$cross" \
    LDFLAGS="--sysroot=$(pwd)/$root -Wl,-rpath-link,$(echo ":$libraries" | sed "s|:|:$(pwd)/$root|g; s|^:||")" \
    >"$folder/log" 2>&1 || { tail "$folder/log"; fail "not built"; }
cp "$folder/build/render-cli" "$root/tmp/"
# Glass and fog, in 32-bit floats.
sed 's|<string name="pixel_format".*|&<string name="component_format" value="float32"/>|' scenes/glass-in-fog.xml \
    >"$root/tmp/scene.xml"

on_arm() {
    timeout 1800 chroot "$root" /usr/bin/qemu-aarch64-static -E LD_LIBRARY_PATH=$libraries -E POCL_CACHE_DIR=/tmp/pocl \
        -E BRUME_CACHE_DIR= -E 'HWLOC_SYNTHETIC=numa:1(memory=4294967296) pu:2' /tmp/render-cli "$@"
}
here() { BRUME_CACHE_DIR= "$build/render-cli" "$@"; }
on_arm --list-devices 2>/dev/null || fail "no device under emulation"

bad=0
for how in '--lanes 4' '--lanes 1 --precision double'; do
    options="-q -D width=40 -D height=24 --spp 4 $how"
    here "$root/tmp/scene.xml" $options -o "$folder/here.exr" || exit 1
    on_arm /tmp/scene.xml $options -o /tmp/arm.exr 2>/dev/null || fail "not rendered: $how"
    echo "check-aarch64: $how: $("$build/test/measure_difference" "$folder/here.exr" "$root/tmp/arm.exr" 0)"
    "$build/test/measure_difference" "$folder/here.exr" "$root/tmp/arm.exr" 0 >/dev/null || bad=1
done
# Another seed is another picture: the comparison sees one.
here "$root/tmp/scene.xml" $options --seed 1 -o "$folder/other.exr"
"$build/test/measure_difference" "$folder/here.exr" "$folder/other.exr" 0 >/dev/null && fail "another seed passes for equal"
[ $bad -eq 0 ] || fail "ARM's pictures differ"
echo "check-aarch64: the same bits"
