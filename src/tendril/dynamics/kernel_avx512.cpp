#include "tendril/dynamics/kernel_lanes.h"

namespace tendril::dynamics {

const Kernel& avx512Kernel() { return makeKernel<8>("avx512"); }

}  // namespace tendril::dynamics
