#include <algorithm>
#include <cmath>
#include <limits>

#include "tendril/statics.h"
#include "tendril/statics/library.h"

namespace tendril {
namespace statics {
namespace {

constexpr std::size_t kStarts = 24;  // library rods tried for being nearest, and as many for being at ease
constexpr int kHeavyEnds = 4000;     // ends of a heavy rod looked at, in either way to its weight
constexpr std::size_t kNeighbours = 200;      // nearest rods among which those of least energy are taken
constexpr std::size_t kAtOnce = 8;            // starts tried side by side where one equilibrium is wanted
constexpr double kRotationWeight = 0.15;      // L per rad, in "nearest"
constexpr double kTolerance = 1e-10;          // of the end pose, L and rad
constexpr double kQuickTolerance = 1e-5;      // the same before the last iterations, which are exact
constexpr double kSmallestShare = 1.0 / 256;  // of the weight
constexpr double kSameWrench = 1e-6;          // relative: one solution, not two

double distance2(const Pose& a, const Pose& b) {
  const double cosine = std::min(1.0, std::abs(a.rotation.dot(b.rotation)));  // of half the angle
  return (a.position - b.position).squaredNorm() + kRotationWeight * kRotationWeight * 8 * (1 - cosine);
}

/// Where to start from, in turn: the library rods that end nearest to a pose, nearest first, then those of
/// least energy among kNeighbours of them: continuation from a rod at ease is what leads to the equilibrium
/// of least energy.
class Starts {
 public:
  Starts(const Library& library, const Pose& target) : library_(library), order_(library.rods.size()) {
    for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = {distance2(library.rods[i].end, target), i};
  }
  [[nodiscard]] std::size_t size() const { return std::min(2 * kStarts, order_.size()); }
  /// The library rod of a start < size(). Most are never asked for: sorts only as far as needed.
  [[nodiscard]] std::size_t rod(std::size_t start) {
    if (start >= sorted_) {
      if (start < kAtOnce) {
        nearestFirst(kAtOnce);
      } else {
        nearestFirst(kNeighbours);
        for (auto rod = at(kStarts); rod != at(kNeighbours); ++rod)
          rod->first = library_.rods[rod->second].energy;
        std::sort(at(kStarts), at(kNeighbours));
      }
    }
    return order_[start].second;
  }

 private:
  [[nodiscard]] std::vector<std::pair<double, std::size_t>>::iterator at(std::size_t n) {
    return order_.begin() + static_cast<std::ptrdiff_t>(std::min(n, order_.size()));
  }
  void nearestFirst(std::size_t count) {
    std::partial_sort(order_.begin(), at(count), order_.end());
    sorted_ = count;
  }

  const Library& library_;
  std::vector<std::pair<double, std::size_t>> order_;  // squared distance (then energy), library rod
  std::size_t sorted_ = 0;
};

/// Damped Newton's method on a towards an end pose: `miss` is the twist along the geodesic from the end to
/// the pose, J da the end's own twist, so small steps follow the geodesic. Only stable rods are stepped on.
class Newton {
 public:
  enum class State { running, arrived, failed };

  Newton(const Vector6& start, const Pose& target, double tolerance)
      : a_(start), trial_(start), target_(target), tolerance_(tolerance) {}
  /// The wrench whose end is asked for next; the solution when `arrived`.
  [[nodiscard]] const Vector6& wrench() const { return trial_; }
  [[nodiscard]] State take(const NaturalEnd& end) {
    const bool usable = end.stable && std::isfinite(end.energy);
    const Vector6 miss = usable ? logSE3(end.end.inverse() * target_) : Vector6::Zero();
    const double size = miss.norm();
    if (usable && size < (1 - 0.25 * damping_) * size_) {
      if (size <= tolerance_) return State::arrived;
      a_ = trial_, size_ = size;
      step_ = end.jacobian.partialPivLu().solve(miss);
      const double length =
          std::max(step_.head<3>().norm() / kLongestMoment, step_.tail<3>().norm() / kLongestForce);
      damping_ = std::min({1.0, 2 * damping_, 1 / length});
    } else {
      damping_ *= 0.5;
      if (damping_ < kLeastDamping || ++refusals_ > kMostRefusals) return State::failed;
    }
    trial_ = a_ + damping_ * step_;
    return State::running;
  }

 private:
  static constexpr double kLongestMoment = 4, kLongestForce = 30;  // of a step
  static constexpr double kLeastDamping = 1.0 / 128;
  static constexpr int kMostRefusals = 12;

  Vector6 a_, trial_, step_ = Vector6::Zero();
  Pose target_;
  double tolerance_, size_ = std::numeric_limits<double>::infinity(), damping_ = 1;
  int refusals_ = 0;
};

/// Runs them side by side, all of them or until one arrives; the wrenches of those that arrive, first come
/// first.
std::vector<Vector6> arrivals(Batch& batch, std::vector<Newton> walks, Wanted wanted) {
  std::vector<Vector6> arrived, wrenches;
  std::vector<Newton> still;
  while (!walks.empty() && (wanted == Wanted::all || arrived.empty())) {
    wrenches.clear(), still.clear();
    for (const Newton& walk : walks) wrenches.push_back(walk.wrench());
    std::vector<Newton::State> states(walks.size());
    batch.ends(wrenches, kQuick, true,
               [&](std::size_t i, const NaturalEnd& end) { states[i] = walks[i].take(end); });
    for (std::size_t i = 0; i < walks.size(); ++i) {
      if (states[i] == Newton::State::arrived) arrived.push_back(walks[i].wrench());
      if (states[i] == Newton::State::running) still.push_back(walks[i]);
    }
    walks.swap(still);
  }
  return arrived;
}

/// The same with one rod. `left` counts down the ends looked at; at none it fails.
bool solve(Integrator& integrator, const Vector3& weight, const Pose& target, double tolerance,
           const Accuracy& accuracy, Vector6& a, int& left) {
  Newton newton(a, target, tolerance);
  NaturalEnd end;
  while (left-- > 0) {
    if (integrator.end(newton.wrench(), weight, accuracy, end) == ChartStatus::inverted) end.stable = false;
    const Newton::State state = newton.take(end);
    if (state == Newton::State::running) continue;
    a = newton.wrench();
    return state == Newton::State::arrived;
  }
  return false;
}

/// Gives a rod between fixed ends its weight, a share at a time, through stable rods.
bool load(Integrator& integrator, const Vector3& weight, const Pose& target, Vector6& a, int& left) {
  double at = 0, step = 0.25;
  while (at < 1) {
    const double next = std::min(1.0, at + step);
    Vector6 trial = a;
    // to first order either end takes half of the weight added
    trial.tail<3>() += 0.5 * (next - at) * weight;
    if (solve(integrator, next * weight, target, kQuickTolerance, kQuick, trial, left)) {
      a = trial, at = next, step *= 2;
    } else {
      step = 0.5 * (next - at);
      if (step < kSmallestShare) return false;
    }
  }
  return true;
}

void addIfNew(std::vector<Vector6>& found, const Vector6& a, double tolerance) {
  for (const Vector6& b : found)
    if ((a - b).norm() <= tolerance * (1 + b.norm())) return;
  found.push_back(a);
}

}  // namespace
}  // namespace statics

using namespace statics;

std::vector<Equilibrium> fitEnds(const RodProperties& rod, const GripperPoses& ends, const Vector3& gravity,
                                 Wanted wanted) {
  const NaturalRod heavy(rod, gravity), light(rod, Vector3::Zero());
  const std::shared_ptr<const Library> library = libraryFor(light);
  Batch batch(light);
  Integrator integrator(heavy);
  const Vector3 weight = ends.first.rotation.conjugate() * heavy.weight;
  Pose target = ends.first.inverse() * ends.last;
  target.position /= heavy.units.length;

  std::vector<Vector6> nearly, found;  // of the light rod, to kQuickTolerance; of the rod
  std::vector<Equilibrium> out;
  EquilibriumIntegrator shapes(rod, gravity);
  int left = kHeavyEnds;
  const auto finish = [&](Vector6 a) {
    if (!heavy.heavy()) left = kHeavyEnds;
    if (!solve(integrator, weight, target, kTolerance, kFine, a, left)) return;
    const std::size_t before = found.size();
    addIfNew(found, a, kSameWrench);
    if (found.size() == before) return;
    Equilibrium e;
    if (shapes.shape(ends.first, heavy.units.wrenchToSi(a), e) == ChartStatus::inverted) return;
    e.stability = Stability::stable;  // as Newton's method found it
    out.push_back(std::move(e));
  };
  Starts starts(*library, target);
  const std::size_t at_once = wanted == Wanted::one ? kAtOnce : starts.size();
  for (std::size_t first = 0; first < starts.size() && (wanted == Wanted::all || out.empty());
       first += at_once) {
    std::vector<Newton> walks;
    for (std::size_t i = first; i < std::min(first + at_once, starts.size()); ++i) {
      const LibraryRod& from = library->rods[starts.rod(i)];
      walks.emplace_back(from.a, target, kQuickTolerance);
      // the first step is known; a rod that ends at the target is found to do so when it is asked again
      (void)walks.back().take({from.end, from.energy, 0, library->jacobians[starts.rod(i)], true});
    }
    const std::size_t known = nearly.size();
    for (const Vector6& a : arrivals(batch, std::move(walks), wanted))
      addIfNew(nearly, a, 100 * kQuickTolerance);
    for (std::size_t i = known; i < nearly.size(); ++i)
      if (Vector6 a = nearly[i]; !heavy.heavy() || load(integrator, weight, target, a, left)) finish(a);
  }
  // Where a light rod is not stable a heavy one may be: the weight first, between the library rod's own ends.
  left = kHeavyEnds;
  if (heavy.heavy() && out.empty())
    for (std::size_t i = 0; i < starts.size() && (wanted == Wanted::all || out.empty()); ++i)
      if (Vector6 a = library->rods[starts.rod(i)].a;
          load(integrator, weight, library->rods[starts.rod(i)].end, a, left))
        finish(a);
  std::stable_sort(out.begin(), out.end(), [](const Equilibrium& x, const Equilibrium& y) {
    return x.energy + x.weight_energy < y.energy + y.weight_energy;
  });
  return out;
}

std::vector<Equilibrium> equilibriaOf(const RodProperties& rod, const Placement& placement,
                                      const Vector3& gravity) {
  if (const auto* ends = std::get_if<GripperPoses>(&placement)) return fitEnds(rod, *ends, gravity);
  const auto& [pose, wrench] = std::get<PoseAndWrench>(placement);
  EquilibriumIntegrator integrator(rod, gravity);
  std::vector<Equilibrium> out(1);
  if (integrator.solve(pose, wrench, out[0]) == ChartStatus::inverted ||
      out[0].stability != Stability::stable)
    out.clear();
  return out;
}

}  // namespace tendril
