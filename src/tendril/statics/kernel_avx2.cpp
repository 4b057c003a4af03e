#include "tendril/statics/kernel_lanes.h"

namespace tendril::statics {

const Kernel& avx2Kernel() { return makeKernel<4>("avx2"); }

}  // namespace tendril::statics
