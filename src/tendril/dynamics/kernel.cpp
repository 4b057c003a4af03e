#include "tendril/dynamics/kernel.h"

namespace tendril::dynamics {

const Kernel& portableKernel();
#ifdef TENDRIL_X86_KERNELS
const Kernel& avx2Kernel();
const Kernel& avx512Kernel();
#endif

const Kernel& kernelFor(InstructionSet set) {
#ifdef TENDRIL_X86_KERNELS
  if (set == InstructionSet::avx2) return avx2Kernel();
  if (set == InstructionSet::avx512) return avx512Kernel();
#endif
  (void)set;
  return portableKernel();
}

const Kernel& kernel() {
  static const Kernel& chosen = kernelFor(instructionSet());
  return chosen;
}

}  // namespace tendril::dynamics
