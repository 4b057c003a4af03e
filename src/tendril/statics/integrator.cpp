#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tendril/statics.h"
#include "tendril/statics/chart.h"
#include "tendril/statics/conjugate_points.h"

namespace tendril {
namespace statics {
namespace {

constexpr double kSmallestStretch = 0.05;  // 1 + u4 at or below this is no rod
constexpr double kTimeTolerance = 1e-10;   // of first_conjugate_t
constexpr int kStepsPerSegment = 2;

/// The integrated rod at the end of one step, with what quintic interpolation needs.
struct Station {
  PathState y, dy, ddy;
};

/// The smallest value on [0, 1] of the cubic with values f0, f1 and derivatives g0, g1 at the ends.
double smallestOfCubic(double f0, double g0, double f1, double g1) {
  double smallest = std::min(f0, f1);
  // f' = g0 + 2 b t + 3 a t^2
  const double a = g0 + g1 - 2 * (f1 - f0), b = 3 * (f1 - f0) - 2 * g0 - g1;
  const double root = b * b - 3 * a * g0;
  if (root < 0) return smallest;
  const double q = -(b + std::copysign(std::sqrt(root), b));
  for (const double t : {q / (3 * a), g0 / q})
    if (t > 0 && t < 1) smallest = std::min(smallest, f0 + t * (g0 + t * (b + t * a)));
  return smallest;
}

/// Whether the wrench inverts the rod where it is applied; no integration is needed to see that.
bool invertedAtBase(const Vector6& c, const Vector6& a) { return 1 + a[3] / c[3] <= kSmallestStretch; }

/// Whether 1 + u4 falls to the limit on a step between two stations; by the cubic through values and slopes.
bool inverted(const Chart& chart, const PathState& from, const PathState& to, double h) {
  return smallestOfCubic(chart.stretch(from), h * chart.stretchRate(from), chart.stretch(to),
                         h * chart.stretchRate(to)) <= kSmallestStretch;
}

/// The quintic through value, first and second derivative at both ends of a step h, at theta in (0, 1).
PathState quintic(const Station& from, const Station& to, double h, double theta) {
  const double t = theta, t2 = t * t, t3 = t2 * t, u = 1 - t;
  const double a1 = t3 * (10 - 15 * t + 6 * t2), a0 = 1 - a1;
  const double b0 = h * t * u * u * u * (1 + 3 * t), b1 = -h * t3 * u * (4 - 3 * t);
  const double c0 = 0.5 * h * h * t2 * u * u * u, c1 = 0.5 * h * h * t3 * u * u;
  return a0 * from.y + a1 * to.y + b0 * from.dy + b1 * to.dy + c0 * from.ddy + c1 * to.ddy;
}

}  // namespace
}  // namespace statics

using namespace statics;

struct EquilibriumIntegrator::Impl {
  RodProperties rod;
  Units units;
  Vector6 c;                      // in the rod's units
  std::vector<Station> stations;  // of the last shape integrated
  Stages<PathState> path_stages;
  Stages<JointState> joint_stages;

  explicit Impl(const RodProperties& properties) : rod(properties), units(rod), c(naturalStiffness(rod)) {
    if (rod.elements < 1)
      throw InputError("the rod has " + std::to_string(rod.elements) + " elements; it needs at least 1");
  }

  /// K over a segment of length `length` that starts at `at`, from K = 0; `at` becomes the segment's end.
  /// Fills the `record` stations of its steps, if given.
  Matrix6 segment(const Chart& chart, PathState& at, double length, Station* record = nullptr) {
    JointState y;
    y.head<8>() = at;
    y.tail<36>().setZero();
    for (int i = 0; i < kStepsPerSegment; ++i) {
      if (record) record[i].y = y.head<8>();
      chart.step(y, length / kStepsPerSegment, joint_stages);
      if (record) record[i].dy = joint_stages[0].head<8>();
    }
    at = y.head<8>();
    return kOf(y);
  }

  /// Fills stations 0..steps and their derivatives; false if the rod is inverted.
  bool integrateShape(const Chart& chart, int steps) {
    stations.resize(static_cast<std::size_t>(steps) + 1);
    const double h = 1.0 / steps;
    stations[0].y = startOfPath();
    for (std::size_t i = 0; i + 1 < stations.size(); ++i) {
      stations[i + 1].y = stations[i].y;
      chart.step(stations[i + 1].y, h, path_stages);
      stations[i].dy = path_stages[0];
    }
    return finishShape(chart);
  }

  /// What the last step leaves out: the end's rate, second derivatives; false if the rod is inverted
  /// somewhere.
  bool finishShape(const Chart& chart) {
    const double h = 1.0 / static_cast<double>(stations.size() - 1);
    stations.back().dy = chart.rate(stations.back().y);
    if (chart.mayInvert(kSmallestStretch))
      for (std::size_t i = 0; i + 1 < stations.size(); ++i)
        if (inverted(chart, stations[i].y, stations[i + 1].y, h)) return false;
    for (Station& s : stations) s.ddy = chart.secondRate(s.y, s.dy);
    return true;
  }

  /// The nodes in world, in metres, and the energy, from the stations.
  void write(const Pose& base, const Vector6& wrench, Equilibrium& out) const {
    const auto place = [&](const PathState& y) {
      Pose q = poseOf(y);
      q.position *= units.length;
      return base * q;
    };
    const int steps = static_cast<int>(stations.size()) - 1, elements = rod.elements;
    const double h = 1.0 / steps;
    out.base = base;
    out.wrench = wrench;
    out.nodes.resize(static_cast<std::size_t>(elements) + 1);
    for (int i = 1; i < elements; ++i) {
      // node i lies at i / elements = (k + rest / elements) / steps
      const std::int64_t at = static_cast<std::int64_t>(i) * steps;
      const auto k = static_cast<std::size_t>(at / elements);
      const std::int64_t rest = at % elements;
      const Station& from = stations[k];
      out.nodes[static_cast<std::size_t>(i)] =
          place(rest == 0 ? from.y : quintic(from, stations[k + 1], h, static_cast<double>(rest) / elements));
    }
    out.nodes.front() = base;
    out.nodes.back() = place(stations.back().y);
    out.energy = stations.back().y[7] * units.energy;
  }

  /// The first conjugate time of an unstable rod: walks again in four times as many segments, so that the
  /// time is far more exact than the verdict needs, up to the one that is not free, and bisects it. At
  /// most 1.
  double firstConjugateTime(const Chart& chart, int coarse_segments) {
    const int segments = 4 * coarse_segments;
    const double length = 1.0 / segments;
    ConjugatePoints points;
    PathState at = startOfPath();
    for (int k = 0; k < segments; ++k) {
      const PathState start = at;
      const Matrix6 x = segment(chart, at, length);
      if (k == 0)
        points.start(x);
      else if (!points.passIfFree(x))
        return k * length + conjugateTimeWithin(chart, points, start, length);
    }
    return 1;
  }

  /// The time, from the start of a segment that holds a conjugate point, to the first.
  double conjugateTimeWithin(const Chart& chart, const ConjugatePoints& before, const PathState& start,
                             double length) {
    double low = 0, high = length;
    while (high - low > kTimeTolerance) {
      const double middle = 0.5 * (low + high);
      PathState at = start;
      (before.isFree(segment(chart, at, middle)) ? low : high) = middle;
    }
    return high;
  }
};

EquilibriumIntegrator::EquilibriumIntegrator(const RodProperties& rod) : impl_(std::make_unique<Impl>(rod)) {}
EquilibriumIntegrator::~EquilibriumIntegrator() = default;
EquilibriumIntegrator::EquilibriumIntegrator(EquilibriumIntegrator&&) noexcept = default;

ChartStatus EquilibriumIntegrator::shape(const Pose& base, const Vector6& wrench, Equilibrium& out) {
  const Vector6 a = impl_->units.wrenchToNatural(wrench);
  if (invertedAtBase(impl_->c, a)) return ChartStatus::inverted;
  if (!impl_->integrateShape(Chart(impl_->c, a), stepCount(impl_->c, a))) return ChartStatus::inverted;
  impl_->write(base, wrench, out);
  return ChartStatus::equilibrium;
}

ChartStatus EquilibriumIntegrator::solve(const Pose& base, const Vector6& wrench, Equilibrium& out) {
  const Vector6 a = impl_->units.wrenchToNatural(wrench);
  if (invertedAtBase(impl_->c, a)) return ChartStatus::inverted;
  const Chart chart(impl_->c, a);
  const int segments = stepCount(impl_->c, a) / kStepsPerSegment;
  const double length = 1.0 / segments;
  std::vector<Station>& stations = impl_->stations;
  stations.resize(static_cast<std::size_t>(segments) * kStepsPerSegment + 1);
  out.conjugate_points = 0;
  out.first_conjugate_t.reset();
  out.stability = Stability::stable;
  ConjugatePoints points;
  PathState at = startOfPath();
  for (int k = 0; k < segments; ++k) {
    const Matrix6 x =
        impl_->segment(chart, at, length, &stations[static_cast<std::size_t>(k) * kStepsPerSegment]);
    if (k == 0) {
      points.start(x);
      continue;
    }
    const bool last = k + 1 == segments;
    const ConjugatePoints before = points;
    if (points.passIfFree(x) && !(last && points.timeLeft(chart, at) <= kMarginalTime)) continue;
    // A conjugate point lies in this segment or, if it is the last, maybe just behind its end.
    const Vector6 times = before.timesToConjugatePoints(x, chart, at);
    const auto inside = static_cast<int>((times.array() < (last ? -kMarginalTime : 0.0)).count());
    if (inside > 0) {
      out.conjugate_points += inside;
      out.stability = Stability::unstable;
    } else if (out.conjugate_points == 0 && last && times[0] <= kMarginalTime) {
      out.stability = Stability::marginal;
      out.first_conjugate_t = std::min(1.0, 1.0 + times[0]);
    }
    points = before;
    points.pass(x);
  }
  if (out.stability == Stability::unstable)
    out.first_conjugate_t = impl_->firstConjugateTime(chart, segments);
  stations.back().y = at;
  if (!impl_->finishShape(chart)) return ChartStatus::inverted;
  impl_->write(base, wrench, out);
  return ChartStatus::equilibrium;
}

bool EquilibriumIntegrator::isStable(const Vector6& wrench) {
  const Vector6 a = impl_->units.wrenchToNatural(wrench);
  const Chart chart(impl_->c, a);
  const bool may_invert = chart.mayInvert(kSmallestStretch);
  const int segments = stepCount(impl_->c, a) / kStepsPerSegment;
  const double length = 1.0 / segments;
  ConjugatePoints points;
  PathState at = startOfPath();
  for (int k = 0; k < segments; ++k) {
    const PathState start = at;
    const Matrix6 x = impl_->segment(chart, at, length);
    if (may_invert && inverted(chart, start, at, length)) return false;
    if (k == 0)
      points.start(x);
    else if (!points.passIfFree(x))
      return false;
  }
  return points.timeLeft(chart, at) > kMarginalTime;
}

ChartStatus EquilibriumIntegrator::endPose(const Vector6& wrench, Pose& end_in_base, Matrix6& jacobian) {
  const Units& units = impl_->units;
  const Vector6 a = units.wrenchToNatural(wrench);
  const Chart chart(impl_->c, a);
  const int steps = stepCount(impl_->c, a);
  const double h = 1.0 / steps;
  const bool may_invert = chart.mayInvert(kSmallestStretch);
  JointState y;
  y.head<8>() = startOfPath();
  y.tail<36>().setZero();
  for (int i = 0; i < steps; ++i) {
    const PathState start = y.head<8>();
    chart.step(y, h, impl_->joint_stages);
    if (may_invert && inverted(chart, start, y.head<8>(), h)) return ChartStatus::inverted;
  }
  const Pose q = poseOf(y.head<8>());
  end_in_base = {q.rotation, q.position * units.length};
  jacobian = adjoint(q.inverse()) * kOf(y);
  jacobian.bottomRows<3>() *= units.length;
  jacobian.leftCols<3>() /= units.moment;
  jacobian.rightCols<3>() /= units.force;
  return ChartStatus::equilibrium;
}

}  // namespace tendril
