#include "tendril/statics/kernel_lanes.h"

namespace tendril::statics {

const Kernel& avx512Kernel() { return makeKernel<8>("avx512"); }

}  // namespace tendril::statics
