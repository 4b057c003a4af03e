#include "tendril/planner/strategies.h"

#include <cmath>

namespace tendril {
namespace {

constexpr double kLongestPiece = 0.15;  // L
constexpr double kLargestTurn = 1;      // rad
constexpr double kStuck = 0.1;          // of a piece: an end that got less far is stuck

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
    const double piece = random.uniform() < 0.5 ? pieceOf(rod) : kShortPiece;
    const double way = random.uniform(piece, kLongestWay);
    return along(rod, end, direction * piece, static_cast<int>(std::ceil(way / piece)));
  }

 private:
  static constexpr double kPull = 0.7;         // else it pushes
  static constexpr double kLongestWay = 3;     // L: it ends where nothing moves any more
  static constexpr double kShortPiece = 0.05;  // L: follows narrow bends
};

}  // namespace

double restTurn(const RodProperties& rod) {
  double most = 0;  // 1/m
  for (int k = 0; k < rod.elements; ++k) most = std::max(most, rod.restCurvature(k).norm());
  return most * rod.length;
}

double pieceOf(const RodProperties& rod) { return std::min(kLongestPiece, kLargestTurn / restTurn(rod)); }

ExtendStrategy::Steps along(const RodProperties& rod, End end, double piece, int pieces) {
  const double way = std::abs(piece) * rod.length;
  const double outward = end == End::last ? 1 : -1, sign = piece < 0 ? -1 : 1;
  std::optional<Vector3> before;
  return [=](const RodShape& now) mutable -> std::optional<Extension> {
    const Pose& at = endPose(now, end);
    Vector3 direction = sign * outward * (at.rotation * Vector3::UnitX());
    if (before) {  // what it meets turns it
      const Vector3 moved = at.position - *before;
      if (moved.norm() < kStuck * way) return std::nullopt;
      direction = moved.normalized();
    }
    if (pieces-- == 0) return std::nullopt;
    before = at.position;
    // The shortest turn that takes the end's tangent to where it goes.
    const Quaternion turn =
        Quaternion::FromTwoVectors(at.rotation * Vector3::UnitX(), sign * outward * direction);
    return Extension{{{.moving = end,
                       .hold_other = false,
                       .target = {(turn * at.rotation).normalized(), at.position + way * direction}}}};
  };
}

ExtendStrategy::Steps lead(const RodProperties& rod, End end, const Pose& target) {
  const double piece = pieceOf(rod) * rod.length;
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

std::vector<StrategyShare> builtInStrategies(double along_share) {
  return {{1 - along_share, std::make_shared<Aim>()}, {along_share, std::make_shared<Along>()}};
}

}  // namespace tendril
