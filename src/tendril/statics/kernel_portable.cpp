#include "tendril/statics/kernel_lanes.h"

namespace tendril::statics {

const Kernel& portableKernel() { return makeKernel<2>("portable"); }

}  // namespace tendril::statics
