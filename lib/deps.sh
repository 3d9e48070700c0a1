# deps.sh -- installs the packages that building, testing and rendering need, on Debian and Ubuntu: as root or through
# sudo. Elsewhere it names what is missing and stops. With everything in place it only asks dpkg once.
#
# On other systems set BRUME_SKIP_DEPS=1 once the packages named here are installed by other means.

# One package a line, and what it is for.
packages='
gcc                     C compiler, linker
g++                     the mesh readers are C++ libraries
libc6-dev               C library headers
make                    the build
clang                   checks every kernel offline as OpenCL C 1.2; second C compiler
ocl-icd-opencl-dev      libOpenCL, which finds the OpenCL drivers
oclgrind                memory errors and races in kernels
opencl-headers          CL/cl.h
pocl-opencl-icd         OpenCL on the CPU, where there is no GPU
libopenexr-dev          EXR pictures (OpenEXRCore)
libstb-dev              PNG pictures
zlib1g-dev              their compression
libjpeg-dev             JPEG pictures (libjpeg-turbo)
libtinyobjloader-dev    OBJ meshes
libexpat1-dev           scene files
libcmocka-dev           tests
gnuplot-nox             the curves of render-cli study
'
names=$(printf '%s' "$packages" | sed -n 's/^\([^ ][^ ]*\) .*/\1/p')
# What else a target needs (make crosscheck).
names="$names $*"

[ -n "$BRUME_SKIP_DEPS" ] && exit 0

if ! command -v apt-get >/dev/null 2>&1 || ! command -v dpkg-query >/dev/null 2>&1; then
    echo "deps: this system has no apt; install what Debian calls:" >&2
    printf '%s' "$packages" | sed '/^$/d' >&2
    echo "deps: then say so with BRUME_SKIP_DEPS=1" >&2
    exit 1
fi

installed=$(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' $names 2>/dev/null | sed -n 's/^.i  *//p')
missing=
for name in $names; do
    case "
$installed
" in
        *"
$name
"*) ;;
        *) missing="$missing $name" ;;
    esac
done
if [ -z "$missing" ]; then
    echo "deps: nothing is missing"
    exit 0
fi

if [ "$(id -u)" -eq 0 ]; then
    as_root=
elif command -v sudo >/dev/null 2>&1; then
    as_root=sudo
else
    echo "deps: not root, and there is no sudo; have these installed:$missing" >&2
    exit 1
fi
echo "deps: installing$missing"
# One broken third-party source fails the update although Debian's own came through: the install decides.
$as_root apt-get -q update || echo "deps: apt-get update failed; trying with the lists there are" >&2
$as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends install $missing || {
    echo "deps: could not install:$missing" >&2
    exit 1
}
