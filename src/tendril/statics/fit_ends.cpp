#include <algorithm>
#include <cmath>
#include <limits>

#include "tendril/statics.h"
#include "tendril/statics/library.h"

namespace tendril {
namespace statics {
namespace {

constexpr std::size_t kStarts = 24;  // library rods tried for being nearest, and as many for being at ease
constexpr std::size_t kNeighbours = 200;  // nearest rods among which those of least energy are taken
constexpr std::size_t kAtOnce = 8;        // starts followed side by side
constexpr double kRotationWeight = 0.15;  // L per rad, in "nearest"
constexpr double kTolerance = 1e-10;      // of the end pose, L and rad
constexpr double kQuickTolerance = 1e-5;  // the same before the last iterations, which are exact
constexpr double kLooseTolerance = 1e-2;  // of the poses on the way
constexpr double kFirstStep = 0.5;        // of the geodesic; doubled after a success, halved after a failure
constexpr double kSmallestStep = 1.0 / 64;
constexpr double kMostTurning = 200;  // of a Newton iterate: further out is astray
constexpr double kSameWrench = 1e-6;  // relative: one solution, not two
constexpr int kIterations = 6;
constexpr Accuracy kExact{3, 1e-6};

double distance2(const Pose& a, const Pose& b) {
  const double cosine = std::min(1.0, std::abs(a.rotation.dot(b.rotation)));  // of half the angle
  return (a.position - b.position).squaredNorm() + kRotationWeight * kRotationWeight * 8 * (1 - cosine);
}

/// Where to start from: the library rods that end nearest to `target`, nearest first, then those of least
/// energy among kNeighbours of them: continuation from a rod at ease is what leads to the equilibrium of
/// least energy.
std::vector<std::size_t> startsFor(const Library& library, const Pose& target) {
  std::vector<std::pair<double, std::size_t>> order(library.size());
  for (std::size_t i = 0; i < library.size(); ++i) order[i] = {distance2(library[i].end, target), i};
  const auto at = [&](std::size_t n) {
    return order.begin() + static_cast<std::ptrdiff_t>(std::min(n, order.size()));
  };
  std::nth_element(order.begin(), at(kNeighbours), order.end());
  std::sort(order.begin(), at(kNeighbours));
  for (auto rod = at(kStarts); rod != at(kNeighbours); ++rod) rod->first = library[rod->second].energy;
  std::sort(at(kStarts), at(kNeighbours));
  std::vector<std::size_t> starts(std::min(2 * kStarts, order.size()));
  for (std::size_t i = 0; i < starts.size(); ++i) starts[i] = order[i].second;
  return starts;
}

/// Newton's method on a towards an end pose; every iteration must take off a quarter of the miss, or a nearer
/// pose is wanted, not more iterations.
class Newton {
 public:
  enum class State { running, arrived, failed };

  void start(const Vector6& a, const Pose& target, double tolerance) {
    a_ = a, target_ = target, tolerance_ = tolerance;
    previous_ = std::numeric_limits<double>::infinity();
    iterations_ = 0;
  }
  [[nodiscard]] const Vector6& wrench() const { return a_; }
  /// Takes the end that wrench() leads to. `arrived` leaves wrench() as it was, the solution.
  [[nodiscard]] State take(const NaturalRod& rod, const NaturalEnd& end) {
    if (!std::isfinite(end.energy)) return State::failed;
    const Vector6 miss = logSE3(end.end.inverse() * target_);
    const double size = miss.norm();
    if (size <= tolerance_) return end.stable ? State::arrived : State::failed;
    if (!(size < 0.75 * previous_) || ++iterations_ == kIterations) return State::failed;
    previous_ = size;
    // The body twist J da moves the end along the geodesic that `miss` is the rest of.
    a_ += end.jacobian.partialPivLu().solve(miss);
    return rod.turning(a_) <= kMostTurning ? State::running : State::failed;
  }

 private:
  Vector6 a_;
  Pose target_;
  double tolerance_ = 0, previous_ = 0;
  int iterations_ = 0;
};

/// A library rod whose end is led to the target along the geodesic between them, through stable rods only.
class Walk {
 public:
  Walk(const LibraryRod& from, const Pose& target)
      : from_(from.end), target_(target), way_(logSE3(from.end.inverse() * target)), a_(from.a) {
    aim();
  }
  [[nodiscard]] const Vector6& wrench() const { return newton_.wrench(); }
  [[nodiscard]] Newton::State take(const NaturalRod& rod, const NaturalEnd& end) {
    const Newton::State state = newton_.take(rod, end);
    if (state == Newton::State::running) return state;
    if (state == Newton::State::arrived) {
      a_ = newton_.wrench(), at_ = next_, step_ *= 2;
      if (at_ == 1) return state;
    } else {
      step_ = 0.5 * (next_ - at_);
      if (step_ < kSmallestStep) return state;
    }
    aim();
    return Newton::State::running;
  }

 private:
  void aim() {
    next_ = std::min(1.0, at_ + step_);
    if (next_ == 1)
      newton_.start(a_, target_, kQuickTolerance);
    else
      newton_.start(a_, from_ * expSE3(next_ * way_), kLooseTolerance);
  }

  Pose from_, target_;
  Vector6 way_, a_;
  double at_ = 0, step_ = kFirstStep, next_ = 0;
  Newton newton_;
};

/// Follows all walks side by side; the wrenches of those that arrive.
std::vector<Vector6> followAll(Batch& batch, std::vector<Walk> walks) {
  std::vector<Vector6> arrived, wrenches;
  std::vector<Walk> still;
  while (!walks.empty()) {
    wrenches.clear(), still.clear();
    for (const Walk& walk : walks) wrenches.push_back(walk.wrench());
    std::vector<Newton::State> states(walks.size());
    batch.ends(wrenches, kQuick, false,
               [&](std::size_t i, const NaturalEnd& end) { states[i] = walks[i].take(batch.rod(), end); });
    for (std::size_t i = 0; i < walks.size(); ++i) {
      if (states[i] == Newton::State::arrived) arrived.push_back(walks[i].wrench());
      if (states[i] == Newton::State::running) still.push_back(walks[i]);
    }
    walks.swap(still);
  }
  return arrived;
}

/// Newton's method with one rod at a time.
bool solveExactly(Integrator& integrator, const Vector3& weight, const Pose& target, double tolerance,
                  const Accuracy& accuracy, Vector6& a) {
  Newton newton;
  newton.start(a, target, tolerance);
  NaturalEnd end;
  for (;;) {
    if (integrator.end(newton.wrench(), weight, accuracy, end) == ChartStatus::inverted) return false;
    const Newton::State state = newton.take(integrator.rod(), end);
    if (state == Newton::State::running) continue;
    a = newton.wrench();
    return state == Newton::State::arrived;
  }
}

/// Gives a rod between fixed ends its weight, a share at a time, through stable rods.
bool load(Integrator& integrator, const Vector3& weight, const Pose& target, Vector6& a) {
  double at = 0, step = 0.25;
  while (at < 1) {
    const double next = std::min(1.0, at + step);
    Vector6 trial = a;
    // to first order either end takes half of the weight added
    trial.tail<3>() += 0.5 * (next - at) * weight;
    if (solveExactly(integrator, next * weight, target, kQuickTolerance, kQuick, trial)) {
      a = trial, at = next, step *= 2;
    } else {
      step = 0.5 * (next - at);
      if (step < kSmallestStep / 4) return false;
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
  const std::vector<std::size_t> starts = startsFor(*library, target);
  const std::size_t at_once = wanted == Wanted::one ? kAtOnce : starts.size();
  for (std::size_t first = 0; first < starts.size() && (wanted == Wanted::all || out.empty());
       first += at_once) {
    std::vector<Walk> walks;
    for (std::size_t i = first; i < std::min(first + at_once, starts.size()); ++i)
      walks.emplace_back((*library)[starts[i]], target);
    const std::size_t known = nearly.size();
    for (const Vector6& a : followAll(batch, std::move(walks))) addIfNew(nearly, a, 100 * kQuickTolerance);
    for (std::size_t i = known; i < nearly.size(); ++i) {
      Vector6 a = nearly[i];
      if (heavy.heavy() && !load(integrator, weight, target, a)) continue;
      if (!solveExactly(integrator, weight, target, kTolerance, kExact, a)) continue;
      const std::size_t before = found.size();
      addIfNew(found, a, kSameWrench);
      if (found.size() == before) continue;
      Equilibrium e;
      if (shapes.solve(ends.first, heavy.units.wrenchToSi(a), e) == ChartStatus::equilibrium &&
          e.stability == Stability::stable)
        out.push_back(std::move(e));
    }
  }
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
