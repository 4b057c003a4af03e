#include "tendril/statics/kernel.h"

#include <vector>

#include "tendril/lanes.h"

namespace tendril::statics {

const Kernel& portableKernel();
#ifdef TENDRIL_X86_KERNELS
const Kernel& avx2Kernel();
const Kernel& avx512Kernel();
#endif

namespace {

const Kernel& kernelFor(InstructionSet set) {
#ifdef TENDRIL_X86_KERNELS
  if (set == InstructionSet::avx2) return avx2Kernel();
  if (set == InstructionSet::avx512) return avx512Kernel();
#endif
  (void)set;
  return portableKernel();
}

}  // namespace

std::span<const Kernel* const> availableKernels() {
  static const std::vector<const Kernel*> available = [] {
    std::vector<const Kernel*> list;
    for (const InstructionSet set : instructionSets()) list.push_back(&kernelFor(set));
    return list;
  }();
  return available;
}

const Kernel& kernel() {
  static const Kernel& chosen = kernelFor(instructionSet());
  return chosen;
}

}  // namespace tendril::statics
