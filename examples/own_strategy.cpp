/// A way to extend of one's own, in one file: derive from ExtendStrategy, put it into
/// PlanRequest::strategies.
///
/// This one zigzags: it draws one end of the rod forward along its tangent, wiggling it to either side, and
/// then moves it to where the target has it. usage: own_strategy SCENARIO
#include <cstdio>

#include "tendril/planner.h"
#include "tendril/verification.h"

using namespace tendril;

class Zigzag : public ExtendStrategy {
 public:
  Steps begin(const RodProperties& rod, const RodShape&, const RodShape& target,
              Random& random) const override {
    const End end = random.uniform() < 0.5 ? End::first : End::last;
    const int pieces = 2 + static_cast<int>(4 * random.uniform());
    return [=, k = 0](const RodShape& now) mutable -> std::optional<Extension> {
      if (k > pieces) return std::nullopt;
      Phase phase{.moving = end, .hold_other = false, .target = endPose(target, end)};
      if (k < pieces) {
        const Pose& at = endPose(now, end);
        const double outward = end == End::last ? 1 : -1, side = k % 2 == 0 ? 1 : -1;
        const Vector3 way(outward * kForward * rod.length, side * kSideways * rod.length,
                          0);  // the end's frame
        phase.target = {at.rotation, at.position + at.rotation * way};
      }
      ++k;
      return Extension{{phase}};
    };
  }

 private:
  static constexpr double kForward = 0.1, kSideways = 0.02;  // L
};

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: own_strategy SCENARIO\n");
    return 2;
  }
  const Scenario scenario = readScenario(argv[1]);
  const Obstacles obstacles(loadMeshes(scenario));

  PlanRequest request;
  request.time_limit_s = 60;
  request.strategies = {{1.0, std::make_shared<Zigzag>()}};  // half of all: the built-in ones add up to 1
  Solution solution = plan(scenario, obstacles, request);
  solution.mesh_sha256 = meshHashes(scenario);
  const bool valid = solution.status == PlanStatus::solved && verify(solution).valid();
  std::printf("%s%s: a motion of %.2f s, %zu controls, after %.2f s and %lld extensions\n",
              name(solution.status), valid ? " and verified" : "", solution.trajectory.time_s.back(),
              solution.controls.size(), solution.run.wall_time,
              static_cast<long long>(solution.run.iterations));
  return valid ? 0 : 1;
} catch (const InputError& error) {
  std::fprintf(stderr, "own_strategy: %s\n", error.what());
  return 2;
}
