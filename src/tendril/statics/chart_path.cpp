#include <algorithm>
#include <cmath>

#include "tendril/statics.h"
#include "tendril/statics/library.h"

namespace tendril {
namespace statics {
namespace {

constexpr int kDetours = 64;  // library rods tried as half-way stations
constexpr double kMomentSpacing = 0.25,
                 kForceSpacing = 2;  // EI/L, EI/L^2: no farther apart are wrenches that are checked
constexpr double kFinest = 1e-4;     // of a leg: stations are not set closer, whatever the stride

/// A way through the chart: a curve a(s), s in [0, 1], in the rod's own units.
struct Leg {
  Vector6 from, to;
  bool shrinking = false;  // (s^2-law below) instead of a straight line: from `from` to 0, or from 0 to `to`

  /// A part [0, x] of a stable rod is a stable rod; blown up to length 1 it carries (x m, x^2 n). If it
  /// neither stretches nor shears, is straight at rest and has no weight, that is a rod of the same kind, so
  /// this way from x = 1 to 0 is stable all along; for other rods nearly.
  [[nodiscard]] Vector6 at(double s) const {
    if (!shrinking) return (1 - s) * from + s * to;
    const bool down = to.isZero(0);
    const double x = down ? 1 - s : s;
    Vector6 a = down ? from : to;
    a.head<3>() *= x, a.tail<3>() *= x * x;
    return a;
  }
  [[nodiscard]] int checks() const {
    const Vector6 way = (to - from).cwiseAbs();
    // twice as many where the curve is not straight: its speed is at most twice the chord's
    const double spacing =
        std::max(way.head<3>().maxCoeff() / kMomentSpacing, way.tail<3>().maxCoeff() / kForceSpacing);
    return 1 + static_cast<int>(std::ceil((shrinking ? 2 : 1) * spacing));
  }
};

class PathFinder {
 public:
  PathFinder(const RodProperties& rod, const Vector3& gravity, const PoseAndWrench& from,
             const PoseAndWrench& to, double stride)
      : natural_(rod, gravity),
        integrator_(natural_),
        from_(from.pose),
        turn_(logSO3(from.pose.rotation.conjugate() * to.pose.rotation)),
        shift_((to.pose.position - from.pose.position) / natural_.units.length),
        stride_(stride) {}

  [[nodiscard]] const NaturalRod& rod() const { return natural_; }
  [[nodiscard]] Pose baseAt(double s) const {
    return {(from_.rotation * expSO3(s * turn_)).normalized(),
            from_.position + s * natural_.units.length * shift_};
  }
  [[nodiscard]] bool isStable(const Vector6& a, double s) {
    return integrator_.isStable(a, baseAt(s).rotation.conjugate() * natural_.weight);
  }
  /// The first s at which the leg is not stable, while the base goes from `begin` to `end` of its way.
  [[nodiscard]] std::optional<double> lostOn(const Leg& leg, double begin, double end) {
    const int checks = leg.checks();
    for (int i = 0; i <= checks; ++i) {
      const double s = static_cast<double>(i) / checks;
      if (!isStable(leg.at(s), begin + s * (end - begin))) return s;
    }
    return std::nullopt;
  }
  /// Appends the leg's stations after its first; false if one of them is not stable.
  [[nodiscard]] bool append(const Leg& leg, double begin, double end, std::vector<ChartStation>& stations) {
    double s = 0, step = 1.0 / leg.checks();
    while (s < 1) {
      const double next = std::min(1.0, s + step);
      const std::optional<ChartStation> station = stationAt(leg.at(next), begin + next * (end - begin));
      if (!station) return false;
      if (next - s > kFinest && farApart(stations.back(), *station)) {
        step = 0.5 * (next - s);
        continue;
      }
      stations.push_back(*station);
      s = next;
      step = std::min(1.0 / leg.checks(), 2 * step);
    }
    return true;
  }
  [[nodiscard]] std::optional<ChartStation> stationAt(const Vector6& a, double s) {
    const Pose base = baseAt(s);
    NaturalEnd end;
    if (integrator_.end(a, base.rotation.conjugate() * natural_.weight, kQuick, end) ==
            ChartStatus::inverted ||
        !end.stable)
      return std::nullopt;
    Pose last = end.end;
    last.position *= natural_.units.length;
    return ChartStation{{base, base * last}, natural_.units.wrenchToSi(a)};
  }

 private:
  [[nodiscard]] bool farApart(const ChartStation& a, const ChartStation& b) const {
    for (const auto& [p, q] :
         {std::pair(a.grippers.first, b.grippers.first), std::pair(a.grippers.last, b.grippers.last)})
      if ((p.position - q.position).norm() > stride_ * natural_.units.length ||
          angleBetween(p.rotation, q.rotation) > stride_)
        return true;
    return false;
  }

  NaturalRod natural_;
  Integrator integrator_;
  Pose from_;
  Vector3 turn_, shift_;
  double stride_;
};

}  // namespace
}  // namespace statics

using namespace statics;

ChartPath chartPath(const RodProperties& rod, const PoseAndWrench& from, const PoseAndWrench& to,
                    const Vector3& gravity, double stride) {
  PathFinder finder(rod, gravity, from, to, stride);
  const Units& units = finder.rod().units;
  const Vector6 a = units.wrenchToNatural(from.wrench), b = units.wrenchToNatural(to.wrench);
  const auto start = finder.stationAt(a, 0);
  if (!start) throw InputError("the way's start is not a stable rod; give another wrench");
  if (!finder.stationAt(b, 1)) throw InputError("the way's goal is not a stable rod; give another wrench");

  ChartPath path;
  const auto follow = [&](const std::vector<Leg>& legs) {
    const double share = 1.0 / static_cast<double>(legs.size());
    for (std::size_t i = 0; i < legs.size(); ++i)
      if (finder.lostOn(legs[i], static_cast<double>(i) * share, static_cast<double>(i + 1) * share))
        return false;
    path.stations = {*start};
    for (std::size_t i = 0; i < legs.size(); ++i)
      if (!finder.append(legs[i], static_cast<double>(i) * share, static_cast<double>(i + 1) * share,
                         path.stations)) {
        path.stations.clear();
        return false;
      }
    path.connected = true;
    return true;
  };

  const Leg straight{a, b};
  path.lost_at = finder.lostOn(straight, 0, 1);
  if (path.lost_at) path.lost_wrench = units.wrenchToSi(straight.at(*path.lost_at));
  if (!path.lost_at && follow({straight})) return path;
  const Vector6 none = Vector6::Zero();
  if (follow({Leg{a, none, true}, Leg{none, b, true}}) || follow({Leg{a, none}, Leg{none, b}})) return path;
  // By way of the library rods nearest to either end's wrench.
  const auto library = libraryFor(finder.rod());
  std::vector<std::pair<double, std::size_t>> order(library->rods.size());
  const Vector6 scale = (Vector6() << 1, 1, 1, 0.15, 0.15, 0.15).finished();
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Vector6& half = library->rods[i].a;
    order[i] = {(half - a).cwiseProduct(scale).norm() + (half - b).cwiseProduct(scale).norm(), i};
  }
  std::sort(order.begin(), order.end());
  for (std::size_t i = 0; i < std::min<std::size_t>(kDetours, order.size()); ++i) {
    const Vector6& half = library->rods[order[i].second].a;
    if (follow({Leg{a, half}, Leg{half, b}})) return path;
  }
  return path;
}

}  // namespace tendril
