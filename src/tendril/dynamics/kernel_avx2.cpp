#include "tendril/dynamics/kernel_lanes.h"

namespace tendril::dynamics {

const Kernel& avx2Kernel() { return makeKernel<4>("avx2"); }

}  // namespace tendril::dynamics
