# check_intel.sh BUILD SCENE... -- the same samples from PoCL and from Intel's OpenCL runtime for CPUs, at 1 and 8
# lanes: every operation that the kernels use is rounded one way, so both give the same bits. The runtime comes from
# PyPI, into BUILD/intel. Exits with 77 where it can't be had.
build=$1
shift
here=$(cd "$(dirname "$0")" && pwd)
folder=$build/intel
if ! [ -e "$folder/venv/lib/libintelocl.so" ]; then
    rm -rf "$folder/venv"
    { python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q -r "$here/intel/requirements.txt"; } || {
        echo "check-intel: skipped: Intel's OpenCL runtime can't be installed" >&2
        exit 77
    }
fi
mkdir -p "$folder/vendors"
cp /etc/OpenCL/vendors/*.icd "$folder/vendors/"
echo "$(cd "$folder/venv/lib" && pwd)/libintelocl.so" >"$folder/vendors/intel.icd"
OCL_ICD_VENDORS=$(cd "$folder/vendors" && pwd) "$build/test/measure_agreement" --device Intel "$@"
