#include "tendril/statics/integrator.h"

#include <algorithm>
#include <cmath>

#include "tendril/statics/laws.h"

namespace tendril::statics {
namespace {

constexpr double kTimeTolerance = 1e-11;  // of first_conjugate_t
constexpr int kMostLocatingSteps = 60;    // bisection alone takes fewer
constexpr int kFinerSteps = 2;            // times as many steps to locate a conjugate time as for the verdict
constexpr int kLocatingSteps = 4 * kStepsPerSegment;  // in a segment, to locate a conjugate time after kFine

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

/// One section with what interpolation between steps needs: everything times h, h^2.
struct Station {
  HeavyChart<double> chart;
  Section<double> s;
  const double* y;

  Station(const SingleRod& rod, const double* state, double start, double h, const double* kappa0)
      : y(state) {
    for (int i = 0; i < 3; ++i) {
      chart.moment[i] = rod.moment[i], chart.weight[i] = rod.weight[i];
      chart.force[i] = rod.force[i] - start * rod.weight[i];
      chart.cm[i] = h * rod.compliance[i], chart.cn[i] = h * rod.compliance[3 + i];
      chart.kappa0[i] = h * kappa0[i];
    }
    chart.h = h;
    sectionAt(chart, y, s);
  }
  [[nodiscard]] Vector3 weightInBody() const {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> r(s.r);
    return r.transpose() * Vector3::Map(chart.weight);
  }
  /// 1 + u4 and h times its derivative.
  [[nodiscard]] double stretch() const { return s.v[0] / chart.h; }
  [[nodiscard]] double stretchRate() const {
    return chart.cn[0] / chart.h * (s.n[1] * s.kappa[2] - s.n[2] * s.kappa[1] - chart.h * weightInBody().x());
  }
  using Frame = Eigen::Array<double, 7, 1>;
  [[nodiscard]] Frame value() const { return Frame::Map(y); }
  [[nodiscard]] Frame first() const {
    Frame rate;
    rotationRate(y, s, rate.data());
    for (int i = 0; i < 3; ++i) rate[4 + i] = positionRate(s, i);
    return rate;
  }
  [[nodiscard]] Frame second() const {
    const Vector3 m = Vector3::Map(s.m), n = Vector3::Map(s.n), kappa = Vector3::Map(s.kappa),
                  v = Vector3::Map(s.v);
    const Vector3 m_rate = m.cross(kappa) + n.cross(v),
                  n_rate = n.cross(kappa) - chart.h * weightInBody();  // eq. (2)
    const Vector3 kappa_rate = Vector3::Map(chart.cm).cwiseProduct(m_rate);
    const Vector3 v_rate = Vector3::Map(chart.cn).cwiseProduct(n_rate);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> r(s.r);
    // Q'' = (Q' kappa + Q kappa') / 2 with kappa as a pure quaternion
    const Frame rate = first();
    const Quaternion q(y[3], y[0], y[1], y[2]), dq(rate[3], rate[0], rate[1], rate[2]);
    const Quaternion k(0, kappa.x(), kappa.y(), kappa.z()),
        dk(0, kappa_rate.x(), kappa_rate.y(), kappa_rate.z());
    Frame out;
    out << 0.5 * ((dq * k).coeffs() + (q * dk).coeffs()), r * (kappa.cross(v) + v_rate);
    return out;
  }
};

/// The quintic through value, first and second derivative (times h, h^2) at both ends of a step, at theta in
/// (0, 1).
Station::Frame quintic(const Station& from, const Station& to, double theta) {
  const double t = theta, t2 = t * t, t3 = t2 * t, u = 1 - t;
  const double a1 = t3 * (10 - 15 * t + 6 * t2), a0 = 1 - a1;
  const double b0 = t * u * u * u * (1 + 3 * t), b1 = -t3 * u * (4 - 3 * t);
  const double c0 = 0.5 * t2 * u * u * u, c1 = 0.5 * t3 * u * u;
  return a0 * from.value() + a1 * to.value() + b0 * from.first() + b1 * to.first() + c0 * from.second() +
         c1 * to.second();
}

/// J(1) from K(1) about the last section, by da in the first node's own axes: `end` is the last section's
/// rotation in base axes, `to_base_axes` the first's.
Matrix6 jacobianFrom(const Matrix6& k, const Quaternion& end, const Quaternion& to_base_axes) {
  const Matrix3 r = to_base_axes.toRotationMatrix(), back = end.toRotationMatrix().transpose();
  Matrix6 out;
  for (int i = 0; i < 6; i += 3)
    for (int j = 0; j < 6; j += 3) out.block<3, 3>(i, j) = back * k.block<3, 3>(i, j) * r;
  return out;
}

Pose poseOf(const double* y) { return {Quaternion(y[3], y[0], y[1], y[2]), Vector3(y[4], y[5], y[6])}; }

}  // namespace

EquilibriumEnd toSi(const NaturalEnd& end, const Units& units) {
  EquilibriumEnd out{{end.end.rotation, units.length * end.end.position},
                     units.energy * end.energy,
                     end.jacobian,
                     end.stable};
  out.jacobian.bottomRows<3>() *= units.length;
  out.jacobian.leftCols<3>() /= units.moment;
  out.jacobian.rightCols<3>() /= units.force;
  return out;
}

void Integrator::begin(const Vector6& a, const Vector3& weight, const Accuracy& accuracy) {
  steps_ = rod_.stepCount(a, accuracy);
  single_.heavy = rod_.heavy();
  for (int i = 0; i < 6; ++i) single_.compliance[i] = rod_.kernel.compliance[i];
  if (single_.heavy) {
    from_base_axes_ = Quaternion::Identity();
    for (int i = 0; i < 3; ++i)
      single_.moment[i] = a[i], single_.force[i] = a[3 + i], single_.weight[i] = weight[i],
      single_.rotation[i] = 0;
    single_.rotation[3] = 1;
  } else {
    const AlignedWrench turned = aligned(a, steps_);
    for (int i = 0; i < 3; ++i)
      single_.moment[i] = turned.moment[i], single_.force[i] = 0, single_.weight[i] = 0;
    single_.force[2] = turned.force;
    for (int i = 0; i < 4; ++i) single_.rotation[i] = turned.rotation[i];
    from_base_axes_ =
        Quaternion(turned.rotation[3], turned.rotation[0], turned.rotation[1], turned.rotation[2])
            .conjugate();
  }
  states_.resize(static_cast<std::size_t>(steps_) + 1);
  states_[0].fill(0);
  std::copy_n(single_.rotation, 4, states_[0].begin());
}

const double* Integrator::kappa0(int step) const {
  const auto count = static_cast<std::int64_t>(rod_.kappa0.size());
  return rod_.kappa0[count == 1 ? 0 : static_cast<std::size_t>(step * count / steps_)].data();
}

/// The segment is a rod of its own, from the section at `state` on: the wrench there is its a, the position
/// and its integral begin at 0.
Segment Integrator::segment(State& state, double start, double h, int count, int step, State* record) const {
  const State from = state;
  const Vector3 origin = Vector3::Map(&from[4]), area = Vector3::Map(&from[7]),
                weight = Vector3::Map(single_.weight);
  const Vector3 force = Vector3::Map(single_.force) - start * weight;
  const Vector3 moment = Vector3::Map(single_.moment) - area.cross(weight) - origin.cross(force);
  SingleRod part = single_;
  Vector3::Map(part.moment) = moment, Vector3::Map(part.force) = force;
  const auto move = [&](State& s, const Vector3& p, const Vector3& a) {
    Vector3::Map(&s[4]) += p;
    if (single_.heavy) Vector3::Map(&s[7]) += a;
  };
  move(state, -origin, -area);
  SegmentMatrices matrices;
  kernel().segment(part, {0, h, count, kappa0(step)}, state.data(),
                   record ? reinterpret_cast<double(*)[kState]>(record) : nullptr, matrices);
  Matrix6 b;
  b << skew(moment), skew(force), skew(force),
      Matrix3::Zero();  // ad_eta^T a = (m x w + n x v; n x w) for eta = (w; v)
  const Segment out(matrices, single_.heavy ? nullptr : &b, poseOf(state.data()),
                    Vector6::Map(single_.compliance));
  move(state, origin, area + count * h * origin);
  if (record)
    for (int i = 0; i < count; ++i) move(record[i], origin, area + i * h * origin);
  return out;
}

bool Integrator::inverted() const {
  const double h = 1.0 / steps_;
  for (int i = 0; i < steps_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Station from(single_, states_[k].data(), i * h, h, kappa0(i));
    const Station to(single_, states_[k + 1].data(), (i + 1) * h, h, kappa0(i));
    if (!(smallestOfCubic(from.stretch(), from.stretchRate(), to.stretch(), to.stretchRate()) >
          kSmallestStretch))
      return true;
  }
  return false;
}

ChartStatus Integrator::integrate(const Vector6& a, const Vector3& weight, const Accuracy& accuracy,
                                  Verdict* verdict) {
  if (1 + a[3] * rod_.kernel.compliance[3] <= kSmallestStretch)
    return ChartStatus::inverted;  // where it is held
  begin(a, weight, accuracy);
  if (verdict) {
    walkThroughConjugatePoints(*verdict, false);
  } else {
    const double h = 1.0 / steps_;
    State state = states_[0];
    // as far as the curvature at rest stays the same
    const int run = steps_ / static_cast<int>(rod_.kappa0.size());
    for (int step = 0; step < steps_; step += run)
      kernel().path(single_, {step * h, h, run, kappa0(step)}, state.data(),
                    reinterpret_cast<double(*)[kState]>(&states_[static_cast<std::size_t>(step)]));
    states_.back() = state;
  }
  if (rod_.leastStretch(a) <= kSmallestStretch && inverted()) return ChartStatus::inverted;
  return ChartStatus::equilibrium;
}

/// `stop`: as soon as the rod is found unstable, with neither count nor time.
void Integrator::walkThroughConjugatePoints(Verdict& verdict, bool stop) {
  const double h = 1.0 / steps_;
  verdict = {};
  k_.setZero(), l_.setIdentity();
  ConjugatePoints points;
  State state = states_[0];
  for (int step = 0; step < steps_; step += kStepsPerSegment) {
    const Segment x =
        segment(state, step * h, h, kStepsPerSegment, step, &states_[static_cast<std::size_t>(step)]);
    x.advance(k_, l_);
    if (step == 0) {
      points.start(x);
      continue;
    }
    const bool last = step + kStepsPerSegment == steps_;
    const ConjugatePoints before = points;
    if (points.passIfFree(x) && !(last && points.timeLeft(x) <= kMarginalTime)) continue;
    // A conjugate point lies in this segment or, if it is the last, maybe just behind its end.
    const Vector6 times = before.timesToConjugatePoints(x);
    const auto inside = static_cast<int>((times.array() < (last ? -kMarginalTime : 0.0)).count());
    if (inside > 0) {
      verdict.conjugate_points += inside;
      verdict.stability = Stability::unstable;
      if (stop) return;
    } else if (verdict.conjugate_points == 0 && last && times[0] <= kMarginalTime) {
      verdict.stability = Stability::marginal;
      verdict.first_conjugate_t = std::min(1.0, 1.0 + times[0]);
    }
    points = before;
    points.pass(x);
  }
  states_.back() = state;
  if (verdict.stability == Stability::unstable) verdict.first_conjugate_t = firstConjugateTime();
}

/// Walks again, up to the segment that is not free, and finds the time in it. At most 1. The segments are
/// longer than the verdict's (as long as those of kQuick): composing many short ones loses digits, and more
/// of them the more slender the rod.
double Integrator::firstConjugateTime() const {
  const double h = 1.0 / steps_;
  const int run = steps_ / static_cast<int>(rod_.kappa0.size());  // the curvature at rest stays the same
  ConjugatePoints points;
  State state = states_[0];
  int count = 0;
  for (int step = 0; step < steps_; step += count) {
    count = std::min(kLocatingSteps, run - step % run);
    const State from = state;
    const double start = step * h, length = count * h;
    const Segment whole = segment(state, start, h / kFinerSteps, kFinerSteps * count, step, nullptr);
    if (step == 0) {
      points.start(whole);
    } else if (!points.passIfFree(whole)) {
      // Newton's method on the nearest of the times that the pencil tells, inside a bracket: free at low, not
      // at high.
      double low = 0, high = length, at = length;
      for (int i = 0; i < kMostLocatingSteps; ++i) {
        State there = from;
        const Segment part =
            segment(there, start, at / (kFinerSteps * count), kFinerSteps * count, step, nullptr);
        const double ahead = points.timesToConjugatePoints(part)[0];
        (ahead > 0 ? low : high) = at;
        if (std::abs(ahead) < kTimeTolerance || high - low < kTimeTolerance) return start + at;
        at += ahead;
        if (!(at > low && at < high)) at = 0.5 * (low + high);
      }
      return start + high;
    }
  }
  return 1;
}

Pose Integrator::node(int i, int elements) const {
  // node i lies at i / elements = (k + rest / elements) / steps
  const std::int64_t at = static_cast<std::int64_t>(i) * steps_;
  const auto k = static_cast<std::size_t>(at / elements);
  const std::int64_t rest = at % elements;
  Pose q;
  if (rest == 0) {
    q = poseOf(states_[k].data());
  } else {
    const double h = 1.0 / steps_;
    const auto step = static_cast<int>(k);
    const Station from(single_, states_[k].data(), step * h, h, kappa0(step));
    const Station to(single_, states_[k + 1].data(), (step + 1) * h, h, kappa0(step));
    q = poseOf(quintic(from, to, static_cast<double>(rest) / elements).data());
  }
  return Pose{from_base_axes_, Vector3::Zero()} * q;
}

double Integrator::weightEnergy() const {
  return single_.heavy ? -Vector3::Map(single_.weight).dot(Vector3::Map(&states_.back()[7])) : 0;
}

void Integrator::fromKernel(const AlignedWrench& wrench, const JointEnd& joint, NaturalEnd& out) {
  using RowMatrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
  const Pose turned{Quaternion(Eigen::Map<const Quaternion>(joint.path.rotation)),
                    Vector3::Map(joint.path.position)};
  const Quaternion to_base_axes(Eigen::Map<const Quaternion>(wrench.rotation));
  out.end = Pose{to_base_axes.conjugate(), Vector3::Zero()} * turned;
  out.energy = joint.path.energy;
  out.weight_energy = 0;
  out.jacobian = jacobianFrom(Eigen::Map<const RowMatrix6>(joint.k), turned.rotation, to_base_axes);
  out.stable = joint.screening == Screening::stable;
}

ChartStatus Integrator::end(const Vector6& a, const Vector3& weight, const Accuracy& accuracy,
                            NaturalEnd& out) {
  if (canScreen(a)) {
    const AlignedWrench wrench = aligned(a, rod_.stepCount(a, accuracy));
    JointEnd joint;
    kernel().joint(rod_.kernel, wrench, accuracy.margin, false, joint);
    fromKernel(wrench, joint, out);
    if (joint.screening == Screening::unsure) out.stable = isStableAtSecondLook(a);
    return ChartStatus::equilibrium;
  }
  Verdict verdict;
  if (integrate(a, weight, accuracy.steps < kFine.steps ? kFine : accuracy, &verdict) ==
      ChartStatus::inverted)
    return ChartStatus::inverted;
  out.stable = verdict.stability == Stability::stable;
  out.end = node(1, 1);
  out.energy = energy();
  out.weight_energy = weightEnergy();
  out.jacobian = jacobianFrom(k_, poseOf(states_.back().data()).rotation, from_base_axes_.conjugate());
  return ChartStatus::equilibrium;
}

bool Integrator::isStable(const Vector6& a, const Vector3& weight) {
  if (canScreen(a)) {
    JointEnd joint;
    kernel().joint(rod_.kernel, aligned(a, rod_.stepCount(a, kScreening)), kScreening.margin, true, joint);
    return joint.screening == Screening::unsure ? isStableAtSecondLook(a)
                                                : joint.screening == Screening::stable;
  }
  return isStableByFineWalk(a, weight);
}

bool Integrator::isStableAtSecondLook(const Vector6& a) {
  JointEnd joint;
  kernel().joint(rod_.kernel, aligned(a, rod_.stepCount(a, kSecondLook)), kSecondLook.margin, true, joint);
  if (joint.screening != Screening::unsure) return joint.screening == Screening::stable;
  return isStableByFineWalk(a, Vector3::Zero());
}

bool Integrator::isStableByFineWalk(const Vector6& a, const Vector3& weight) {
  if (1 + a[3] * rod_.kernel.compliance[3] <= kSmallestStretch) return false;
  begin(a, weight, kFine);
  Verdict verdict;
  walkThroughConjugatePoints(verdict, true);
  return verdict.stability == Stability::stable && !(rod_.leastStretch(a) <= kSmallestStretch && inverted());
}

}  // namespace tendril::statics
