// The public header as C++ sees it.
#include "header_sizes.h"

extern "C" void header_sizes_cxx(unsigned *out)
{
    HEADER_FILL(out);
}
