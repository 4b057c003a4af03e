#include <cstdlib>
#include <string>
#include <vector>

#include "tendril/base.h"
#include "tendril/lanes.h"

namespace tendril {

std::span<const InstructionSet> instructionSets() {
  static const std::vector<InstructionSet> available = [] {
    std::vector<InstructionSet> list = {InstructionSet::portable};
#ifdef TENDRIL_X86_KERNELS
    const bool fused = __builtin_cpu_supports("fma");
    if (fused && __builtin_cpu_supports("avx2")) list.push_back(InstructionSet::avx2);
    if (fused && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
      list.push_back(InstructionSet::avx512);
#endif
    return list;
  }();
  return available;
}

InstructionSet instructionSet() {
  static const InstructionSet chosen = [] {
    const char* wanted = std::getenv("TENDRIL_KERNEL");
    if (!wanted) return instructionSets().back();
    for (const InstructionSet set : instructionSets())
      if (std::string(wanted) == name(set)) return set;
    throw InputError(std::string("TENDRIL_KERNEL is \"") + wanted +
                     "\", which is none of the kernels this machine can run; unset it");
  }();
  return chosen;
}

const char* name(InstructionSet set) {
  switch (set) {
    case InstructionSet::portable:
      return "portable";
    case InstructionSet::avx2:
      return "avx2";
    case InstructionSet::avx512:
      return "avx512";
  }
  return "";
}

}  // namespace tendril
