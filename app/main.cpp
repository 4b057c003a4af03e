/// tendril: the command line. Parses arguments, calls the library, prints, and turns outcomes into exit
/// statuses.
#include <fmt/format.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

#include "commands.h"
#include "tendril/base.h"

namespace {

constexpr int kBadInput = 2;

/// Has the heap lie in large pages, where the system grants them, and keep what is freed. A large mesh takes
/// tens of megabytes for a moment; the first touch of every small page of these can take longer than the
/// work.
void useLargePages() {
  constexpr int kHeap = 256 << 20;  // bytes of addresses; memory is what is touched
  constexpr std::uintptr_t kPage = 1 << 21;
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, kHeap);
  mallopt(M_TOP_PAD, kHeap);
  void* in_heap = std::malloc(kPage);  // makes the heap grow, once
  const std::uintptr_t begin = reinterpret_cast<std::uintptr_t>(in_heap) / kPage * kPage + kPage;
  const auto end = reinterpret_cast<std::uintptr_t>(sbrk(0));
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
  std::free(in_heap);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tendril;
  useLargePages();
  CLI::App app("Plans the motion of an elastic rod, held by its ends, through obstacles it may touch.",
               "tendril");
  app.set_version_flag("--version", "tendril " TENDRIL_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit status: 0 done; 1 no (no path, invalid, not reproduced, no equilibrium, cancelled); 2 bad "
      "input.\n"
      "Example: tendril plan scenarios/double-funnel.yaml --seed 1");
  int status = 0;
  app::addPlan(app, status);
  app::addVerify(app, status);
  app::addReplay(app, status);
  app::addView(app, status);
  app::addSample(app, status);
  app::addEquilibrium(app, status);
  app::addSimulate(app, status);
  app::addBenchmark(app, status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadInput;
  } catch (const InputError& error) {
    fmt::print(stderr, "tendril: {}\n", error.what());
    return kBadInput;
  } catch (const std::exception& error) {  // of a library: a path or a device it cannot handle
    fmt::print(stderr, "tendril: unexpected: {}\n", error.what());
    return kBadInput;
  }
  return status;
}
