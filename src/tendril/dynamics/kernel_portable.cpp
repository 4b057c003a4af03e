#include "tendril/dynamics/kernel_lanes.h"

namespace tendril::dynamics {

const Kernel& portableKernel() { return makeKernel<2>("portable"); }

}  // namespace tendril::dynamics
