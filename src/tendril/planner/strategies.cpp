#include "tendril/planner/strategies.h"

#include <cmath>

namespace tendril {
namespace {

End randomEnd(Random& random) { return random.uniform() < 0.5 ? End::last : End::first; }

/// Algorithm 1.
class Aim : public ExtendStrategy {
 public:
  Steps begin(const RodProperties&, const RodShape&, const RodShape& target, Random& random) const override {
    return [extension = algorithm1(randomEnd(random), {target.front(), target.back()}),
            done = false](const RodShape&) mutable -> std::optional<Extension> {
      if (std::exchange(done, true)) return std::nullopt;
      return extension;
    };
  }
};

/// Pulls or pushes an end along its own tangent.
class Along : public ExtendStrategy {
 public:
  Steps begin(const RodProperties& rod, const RodShape&, const RodShape&, Random& random) const override {
    const End end = randomEnd(random);
    const double direction = random.uniform() < kPull ? 1 : -1;
    const int pieces = 1 + static_cast<int>(random.uniform(0, kMostPieces));
    return along(rod, end, direction, pieces);
  }

 private:
  static constexpr double kPull = 0.7;  // else it pushes
  static constexpr double kMostPieces = 8;
};

}  // namespace

ExtendStrategy::Steps along(const RodProperties& rod, End end, double direction, int pieces) {
  const double way = direction * (end == End::last ? 1 : -1) * kPiece * rod.length;
  return [=](const RodShape& now) mutable -> std::optional<Extension> {
    if (pieces-- == 0) return std::nullopt;
    Pose target = endPose(now, end);
    target.position += way * (target.rotation * Vector3::UnitX());
    return Extension{{{.moving = end, .hold_other = false, .target = target}}};
  };
}

ExtendStrategy::Steps lead(const RodProperties& rod, End end, const Pose& target) {
  const double piece = kPiece * rod.length;
  double before = std::numeric_limits<double>::infinity();
  return [=](const RodShape& now) mutable -> std::optional<Extension> {
    const Pose& at = endPose(now, end);
    const double left = (target.position - at.position).norm();
    if (left < 0.1 * piece || left > before - 0.1 * piece) return std::nullopt;  // there, or stuck
    before = left;
    const double share = std::min(1.0, piece / left);
    return Extension{{{.moving = end,
                       .hold_other = false,
                       .target = {at.rotation.slerp(share, target.rotation),
                                  at.position + share * (target.position - at.position)}}}};
  };
}

std::vector<StrategyShare> builtInStrategies() {
  return {{0.75, std::make_shared<Aim>()}, {0.25, std::make_shared<Along>()}};
}

}  // namespace tendril
