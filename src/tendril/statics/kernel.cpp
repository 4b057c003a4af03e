#include "tendril/statics/kernel.h"

#include <cstdlib>
#include <string>
#include <vector>

#include "tendril/base.h"

namespace tendril::statics {

const Kernel& portableKernel();
#ifdef TENDRIL_X86_KERNELS
const Kernel& avx2Kernel();
const Kernel& avx512Kernel();
#endif

std::span<const Kernel* const> availableKernels() {
  static const std::vector<const Kernel*> available = [] {
    std::vector<const Kernel*> list = {&portableKernel()};
#ifdef TENDRIL_X86_KERNELS
    if (__builtin_cpu_supports("avx2")) list.push_back(&avx2Kernel());
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
      list.push_back(&avx512Kernel());
#endif
    return list;
  }();
  return available;
}

const Kernel& kernel() {
  static const Kernel& chosen = []() -> const Kernel& {
    const char* wanted = std::getenv("TENDRIL_KERNEL");
    if (!wanted) return *availableKernels().back();
    for (const Kernel* k : availableKernels())
      if (std::string(wanted) == k->name) return *k;
    throw InputError(std::string("TENDRIL_KERNEL is \"") + wanted +
                     "\", which is none of the kernels this machine can run; unset it");
  }();
  return chosen;
}

}  // namespace tendril::statics
