#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>

#include "tendril/statics.h"
#include "tendril/statics/chart.h"

namespace tendril {
namespace statics {
namespace {

constexpr std::size_t kLibrarySize = 2000;
constexpr std::uint64_t kLibrarySeed = 2014;
constexpr std::size_t kStarts = 20;  // library rods tried for being nearest, and as many for being at ease
constexpr std::size_t kNeighbours = 200;  // nearest rods among which those of least energy are taken
constexpr double kRotationWeight = 0.15;  // L per rad, in "nearest"
constexpr double kTolerance = 1e-11;      // of the end pose, L and rad
constexpr double kLooseTolerance = 1e-2;  // of the poses on the way
constexpr double kFirstStep = 0.3;        // of the geodesic; doubled after a success, halved after a failure
constexpr double kSmallestStep = 1.0 / 64;
constexpr double kLargestRate = 200;  // rateBound of a Newton iterate: further out is astray
constexpr double kSameWrench = 1e-6;  // relative: one solution, not two

/// A stable rod, where it ends and its energy, in the rod's units, from a first node at the origin.
struct LibraryRod {
  Vector6 a;
  Pose end;
  double energy;
};
using Library = std::vector<LibraryRod>;

/// A rod of length 1 whose SI units are its natural ones.
RodProperties naturalRod(const Vector6& c) {
  RodProperties rod;
  rod.length = 1;
  rod.c = c;
  rod.elements = 1;
  return rod;
}

/// The straight unloaded rod, rods loaded along one axis, and random stable rods of the default sampling box.
Library makeLibrary(const Vector6& c) {
  const RodProperties rod = naturalRod(c);
  EquilibriumIntegrator integrator(rod);
  Equilibrium shape;
  Library library;
  library.reserve(kLibrarySize);
  const auto add = [&](const Vector6& a) {
    if (integrator.isStable(a) && integrator.shape({}, a, shape) == ChartStatus::equilibrium)
      library.push_back({a, shape.nodes.back(), shape.energy});
  };
  add(Vector6::Zero());
  for (int axis = 0; axis < 6; ++axis)
    for (const double part : {0.2, 0.4, 0.6, 0.8, 1.0})
      for (const double sign : {1.0, -1.0}) add(sign * part * (axis < 3 ? 6.0 : 35.0) * Vector6::Unit(axis));
  const SamplingBox box;
  Random random(kLibrarySeed);
  // A rod so soft in shear or stretch that few of the box's wrenches are stable gets the library those few
  // make.
  for (std::size_t draws = 0; library.size() < kLibrarySize && draws < 50 * kLibrarySize; ++draws) {
    Vector6 a;
    for (int i = 0; i < 3; ++i) a[i] = random.uniform(-box.moment, box.moment);
    for (int i = 3; i < 6; ++i) a[i] = random.uniform(-box.force, box.force);
    add(a);
  }
  return library;
}

/// The library for a stiffness: built once, kept for the stiffnesses used last. Thread-safe; what is returned
/// depends on c alone.
std::shared_ptr<const Library> libraryFor(const Vector6& c) {
  constexpr std::size_t kKept = 4;
  static std::mutex mutex;
  static std::vector<std::pair<Vector6, std::shared_ptr<const Library>>> kept;
  const std::lock_guard lock(mutex);
  for (const auto& [stiffness, library] : kept)
    if (stiffness == c) return library;
  if (kept.size() == kKept) kept.erase(kept.begin());
  kept.emplace_back(c, std::make_shared<const Library>(makeLibrary(c)));
  return kept.back().second;
}

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
  const auto neighbours = order.begin() + static_cast<std::ptrdiff_t>(std::min(kNeighbours, order.size()));
  std::partial_sort(order.begin(), neighbours, order.end());
  const auto nearest = order.begin() + static_cast<std::ptrdiff_t>(std::min(kStarts, order.size()));
  for (auto rod = nearest; rod != neighbours; ++rod) rod->first = library[rod->second].energy;
  std::sort(nearest, neighbours);
  std::vector<std::size_t> starts(std::min(2 * kStarts, order.size()));
  for (std::size_t i = 0; i < starts.size(); ++i) starts[i] = order[i].second;
  return starts;
}

/// Newton on a until the end stands at `target` within `tolerance`; false, and `a` undefined, if it does not
/// get there with every iteration taking off a quarter of the miss: then a nearer target is wanted, not more
/// iterations.
bool solveForEnd(EquilibriumIntegrator& integrator, const Vector6& c, const Pose& target, double tolerance,
                 Vector6& a) {
  constexpr int kIterations = 6;
  double previous = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kIterations; ++i) {
    Pose end;
    Matrix6 jacobian;
    if (!(rateBound(c, a) <= kLargestRate) || integrator.endPose(a, end, jacobian) == ChartStatus::inverted)
      return false;
    const Vector6 miss = logSE3(end.inverse() * target);
    if (miss.norm() <= tolerance) return true;
    if (!(miss.norm() < 0.75 * previous)) return false;
    previous = miss.norm();
    // The body twist J da moves the end along the geodesic that `miss` is the rest of.
    a += jacobian.partialPivLu().solve(miss);
  }
  return false;
}

/// Leads a library rod's end to `target` along the geodesic between them through stable rods only.
bool followGeodesic(EquilibriumIntegrator& integrator, const Vector6& c, const LibraryRod& from,
                    const Pose& target, Vector6& a) {
  const Vector6 way = logSE3(from.end.inverse() * target);
  a = from.a;
  double at = 0, step = kFirstStep;
  while (at < 1) {
    const double next = std::min(1.0, at + step);
    const bool arrives = next == 1;
    const Pose goal = arrives ? target : from.end * expSE3(next * way);
    Vector6 trial = a;
    if (solveForEnd(integrator, c, goal, arrives ? kTolerance : kLooseTolerance, trial) &&
        integrator.isStable(trial)) {
      a = trial, at = next, step *= 2;
    } else {
      step = 0.5 * (next - at);
      if (step < kSmallestStep) return false;
    }
  }
  return true;
}

}  // namespace
}  // namespace statics

using namespace statics;

std::vector<Equilibrium> fitEnds(const RodProperties& rod, const GripperPoses& ends) {
  const Units units(rod);
  const Vector6 c = naturalStiffness(rod);
  const std::shared_ptr<const Library> library = libraryFor(c);
  EquilibriumIntegrator natural(naturalRod(c));
  Pose target = ends.first.inverse() * ends.last;
  target.position /= units.length;

  std::vector<Vector6> found;
  for (const std::size_t start : startsFor(*library, target)) {
    Vector6 a;
    if (!followGeodesic(natural, c, (*library)[start], target, a)) continue;
    const bool known = std::any_of(found.begin(), found.end(), [&](const Vector6& b) {
      return (a - b).norm() <= kSameWrench * (1 + b.norm());
    });
    if (!known) found.push_back(a);
  }

  std::vector<Equilibrium> out;
  EquilibriumIntegrator integrator(rod);
  for (const Vector6& a : found) {
    Equilibrium e;
    if (integrator.solve(ends.first, units.wrenchToSi(a), e) == ChartStatus::equilibrium &&
        e.stability == Stability::stable)
      out.push_back(std::move(e));
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const Equilibrium& x, const Equilibrium& y) { return x.energy < y.energy; });
  return out;
}

std::vector<Equilibrium> equilibriaOf(const RodProperties& rod, const Placement& placement) {
  if (const auto* ends = std::get_if<GripperPoses>(&placement)) return fitEnds(rod, *ends);
  const auto& [pose, wrench] = std::get<PoseAndWrench>(placement);
  EquilibriumIntegrator integrator(rod);
  std::vector<Equilibrium> out(1);
  if (integrator.solve(pose, wrench, out[0]) == ChartStatus::inverted ||
      out[0].stability != Stability::stable)
    out.clear();
  return out;
}

}  // namespace tendril
