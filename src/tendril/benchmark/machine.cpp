#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>

#include "tendril/benchmark.h"

namespace tendril {

Machine thisMachine() {
  Machine machine;
  std::array<char, 256> host{};
  machine.host = gethostname(host.data(), host.size() - 1) == 0 ? host.data() : "unknown";
  machine.processor = "unknown";
  machine.processors = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || colon + 2 >= line.size()) continue;
    const std::string value = line.substr(colon + 2);
    if (line.starts_with("model name")) machine.processor = value;
    if (line.starts_with("cpu MHz"))
      machine.clock_mhz = std::max(machine.clock_mhz, std::strtod(value.c_str(), nullptr));
  }
  return machine;
}

}  // namespace tendril
