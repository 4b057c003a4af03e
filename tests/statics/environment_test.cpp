// The whole program: libraries of rods stay in memory, whatever the user's cache holds.
#include <gtest/gtest.h>

#include <cstdlib>

namespace {

class NoCache : public testing::Environment {
 public:
  void SetUp() override { ::setenv("TENDRIL_CACHE", "", 1); }
};
[[maybe_unused]] const testing::Environment* const kNoCache = testing::AddGlobalTestEnvironment(new NoCache);

}  // namespace
