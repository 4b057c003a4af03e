/// Queries for continuous collision detection, of every kind that could be missed, and the verdict on a
/// claim.
///
/// A claim "free up to f" is first put to a filter in long double: over an interval of time, for a unit
/// vector n and corners p_i, q_j, n . (p_i - q_j) is linear in time and bounds the distance from below. Where
/// the filter cannot confirm the claim, exact_motion.h decides. The filter never denies.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "geometry/exact_motion.h"
#include "tendril/geometry.h"

namespace tendril::motion_queries {

using Real = long double;
using V = Eigen::Matrix<Real, 3, 1>;

enum class Pair { point_triangle, segment_edge, segment_triangle, segment_segment };
constexpr std::array<const char*, 4> kPairNames = {"point-triangle", "segment-edge", "segment-triangle",
                                                   "segment-segment"};

enum class Kind {
  random,
  near,
  grazing,
  parallel,
  degenerate,
  far,
  scaled,
  simulation,
  turning,
  mixed,
  extreme
};
constexpr std::array<const char*, 11> kKindNames = {"random",     "near-touching", "grazing", "parallel",
                                                    "degenerate", "far from 0",    "scaled",  "simulation",
                                                    "turning",    "mixed",         "extreme"};

struct Query {
  Pair pair;
  Kind kind;
  exact::Motion motion;
  double radius, keep;
};

/// What the function under test says.
inline double ask(const Query& query) {
  const auto& [np, nq, p, dp, q, dq] = query.motion;
  const double r = query.radius, k = query.keep;
  switch (query.pair) {
    case Pair::point_triangle:
      return freeMotionPointTriangle(p[0], dp[0], q[0], q[1], q[2], r, k);
    case Pair::segment_edge:
      return freeMotionSegmentEdge(p[0], p[1], dp[0], dp[1], q[0], q[1], r, k);
    case Pair::segment_triangle:
      return freeMotionSegmentTriangle(p[0], p[1], dp[0], dp[1], q[0], q[1], q[2], r, k);
    default:
      return freeMotionSegmentSegment(p[0], p[1], dp[0], dp[1], q[0], q[1], dq[0], dq[1], r, k);
  }
}

// ---------------------------------------------------------------------------------------------- the filter

/// The bodies at one moment, in long double, and the vector from the nearest point of Q to that of P, found
/// feature by feature and rounded: good for a direction, and for a distance within rounding.
class Moment {
 public:
  Moment(const exact::Motion& m, Real t) : np_(m.np), nq_(m.nq) {
    const auto at = [t](const Vector3& x, const Vector3& dx) {
      return V(x.cast<Real>() + t * dx.cast<Real>());
    };
    for (std::size_t i = 0; i < 2; ++i) p_[i] = at(m.p[i], m.dp[i]);
    for (std::size_t i = 0; i < 3; ++i) q_[i] = at(m.q[i], m.dq[i]);
    const int q_edges = nq_ == 3 ? 3 : 1;
    for (int i = 0; i < np_; ++i)
      for (int j = 0; j < q_edges; ++j) pointEdge(p_[i], q_[j], q_[(j + 1) % nq_], 1);
    if (np_ == 2) {
      for (int j = 0; j < nq_; ++j) pointEdge(q_[j], p_[0], p_[1], -1);
      for (int j = 0; j < q_edges; ++j) edgeEdge(q_[j], q_[(j + 1) % nq_]);
    }
    if (nq_ == 3)
      for (int i = 0; i < np_; ++i) pointFace(p_[i]);
  }
  [[nodiscard]] const V& apart() const { return apart_; }

 private:
  void take(const V& apart) {
    const Real distance2 = apart.squaredNorm();
    if (distance2 < distance2_) distance2_ = distance2, apart_ = apart;
  }
  void pointEdge(const V& x, const V& a, const V& b, int sign) {
    const V e = b - a, w = x - a;
    const Real e2 = e.squaredNorm();
    const Real t = e2 > 0 ? std::min<Real>(std::max<Real>(w.dot(e) / e2, 0), 1) : 0;
    take(Real(sign) * (t < Real(0.5) ? V(w - t * e) : V(x - b + (1 - t) * e)));
  }
  void edgeEdge(const V& q0, const V& q1) {
    const V d = p_[1] - p_[0], e = q1 - q0, w = q0 - p_[0], n = d.cross(e);
    const Real n2 = n.squaredNorm(), s = w.cross(e).dot(n), t = w.cross(d).dot(n);
    if (n2 > 0 && s > 0 && s < n2 && t > 0 && t < n2) take(-(w.dot(n) / n2) * n);
  }
  void pointFace(const V& x) {
    const V w = x - q_[0], e = q_[1] - q_[0], g = q_[2] - q_[0], n = e.cross(g);
    const Real n2 = n.squaredNorm(), b = n.dot(w.cross(g)), c = n.dot(e.cross(w));
    if (n2 > 0 && b > 0 && c > 0 && b + c < n2) take(w.dot(n) / n2 * n);
  }

  int np_, nq_;
  std::array<V, 2> p_;
  std::array<V, 3> q_;
  V apart_ = V::Zero();
  Real distance2_ = std::numeric_limits<Real>::infinity();
};

/// Confirms that the distance is at least `radius` at every moment of [0, f], or does not.
///
/// With S the sum of the largest coordinates of p, q, dp, dq and u the unit roundoff, the computed
/// n . (p_i - q_j) + t n . (dp_i - dq_j) is off by less than 13 u S (three products and five sums of numbers
/// whose absolute values sum to at most sqrt(3) S), and |n| differs from 1 by less than 4 u, which costs
/// another 4 sqrt(3) u S. The margin is 64 u S. Products of doubles neither under- nor overflow in the wider
/// exponent.
class Filter {
 public:
  explicit Filter(const exact::Motion& motion) : motion_(motion) {
    Real sum = 0;
    const auto add = [&](const auto& corners, int count) {
      Real largest = 0;
      for (int i = 0; i < count; ++i)
        largest = std::max<Real>(largest, corners[static_cast<std::size_t>(i)].cwiseAbs().maxCoeff());
      sum += largest;
    };
    add(motion.p, motion.np), add(motion.dp, motion.np), add(motion.q, motion.nq), add(motion.dq, motion.nq);
    margin_ = 32 * std::numeric_limits<Real>::epsilon() * sum;
  }

  [[nodiscard]] bool confirms(double f, double radius) {
    target_ = radius + margin_;
    moments_ = 0;
    V first, last;
    return direction(0, first) && direction(f, last) && confirms(0, f, first, last);
  }

 private:
  static constexpr int kMoments = 100;

  bool direction(Real t, V& n) {
    if (++moments_ > kMoments) return false;
    n = Moment(motion_, t).apart();
    const Real length = n.norm();
    if (!(length > target_)) return false;
    n /= length;
    return true;
  }
  [[nodiscard]] bool separates(const V& n, Real from, Real to) const {
    for (std::size_t i = 0; i < static_cast<std::size_t>(motion_.np); ++i)
      for (std::size_t j = 0; j < static_cast<std::size_t>(motion_.nq); ++j) {
        const Real height = n.dot(motion_.p[i].cast<Real>() - motion_.q[j].cast<Real>());
        const Real rate = n.dot(motion_.dp[i].cast<Real>() - motion_.dq[j].cast<Real>());
        if (!(height + from * rate >= target_ && height + to * rate >= target_)) return false;
      }
    return true;
  }
  bool confirms(Real from, Real to, const V& at_from, const V& at_to) {
    if (separates(at_to, from, to) || separates(at_from, from, to)) return true;
    const Real middle = (from + to) / 2;
    V at_middle;
    return direction(middle, at_middle) && confirms(middle, to, at_middle, at_to) &&
           confirms(from, middle, at_from, at_middle);
  }

  const exact::Motion& motion_;
  Real margin_ = 0, target_ = 0;
  int moments_ = 0;
};

/// Is the distance at least `radius` at every moment of [0, f]? And who says so.
struct Judgement {
  exact::Verdict verdict;
  bool by_filter;
};
inline Judgement judge(const exact::Motion& motion, double f, double radius) {
  if (Filter(motion).confirms(f, radius)) return {exact::Verdict::free, true};
  return {exact::decide(motion, f, radius), false};
}

/// The distance that a query asks to keep: radius + keep * (initial gap), rounded, where there is a gap.
inline double distanceToKeep(const Query& query) {
  const Real distance = Moment(query.motion, 0).apart().norm();
  return static_cast<double>(query.radius + query.keep * std::max<Real>(distance - query.radius, 0));
}

/// How the answers to many queries were settled.
struct Tally {
  std::int64_t queries = 0, claims = 0, to_the_end = 0;
  std::int64_t exactly = 0;       // claims settled in exact arithmetic, because the filter could not
  std::int64_t both = 0;          // claims settled by the filter and by exact arithmetic
  std::int64_t missed = 0;        // the distance falls below the radius within a claim
  std::int64_t not_kept = 0;      // it falls below the distance to keep
  std::int64_t undecided = 0;     // exact arithmetic could not settle it
  std::int64_t filter_wrong = 0;  // the filter confirmed what exact arithmetic denies
  std::int64_t out_of_range = 0;  // not a number in [0, 1]

  void add(const Tally& other) {
    queries += other.queries, claims += other.claims, to_the_end += other.to_the_end,
        exactly += other.exactly;
    both += other.both, missed += other.missed, not_kept += other.not_kept, undecided += other.undecided;
    filter_wrong += other.filter_wrong, out_of_range += other.out_of_range;
  }
};

/// Puts the function's answer f to the test; where the filter settles it and `both`, exact arithmetic as
/// well.
inline void test(const Query& query, double f, bool both, Tally& tally) {
  ++tally.queries;
  if (!(f >= 0 && f <= 1)) {
    ++tally.out_of_range;
    return;
  }
  if (f == 0) return;  // claims nothing
  ++tally.claims, tally.to_the_end += f == 1;
  const double keep = distanceToKeep(query);
  Judgement judgement = judge(query.motion, f, keep);
  if (judgement.verdict == exact::Verdict::hit) {
    ++tally.not_kept;
    judgement = judge(query.motion, f, query.radius);
    tally.missed += judgement.verdict == exact::Verdict::hit;
  }
  tally.undecided += judgement.verdict == exact::Verdict::undecided;
  tally.exactly += !judgement.by_filter;
  if (judgement.by_filter && both) {
    ++tally.both;
    tally.filter_wrong += exact::decide(query.motion, f, keep) == exact::Verdict::hit;
  }
}

// ---------------------------------------------------------------------------------------------- the queries

/// Draws queries of all kinds.
class Generator {
 public:
  explicit Generator(std::uint64_t seed) : random_(seed) {}

  Query operator()() {
    Query query{};
    query.pair = static_cast<Pair>(below(4));
    query.kind = static_cast<Kind>(below(static_cast<int>(kKindNames.size())));
    query.motion.np = query.pair == Pair::point_triangle ? 1 : 2;
    query.motion.nq = query.pair == Pair::point_triangle || query.pair == Pair::segment_triangle ? 3 : 2;
    query.keep = below(2) == 0 ? 0 : random_.uniform(0, 0.9);
    switch (query.kind) {
      case Kind::random:
        make(query, Shape::any, Path::any, 1, 0, power(-3, 0), power(-3, 0));
        break;
      case Kind::near:
        make(query, Shape::any, anyPath(), 1, 0, power(-3, 0), power(-15, -3));
        break;
      case Kind::grazing:
        make(query, Shape::any, Path::grazing, 1, 0, power(-3, 0), power(-12, -1));
        break;
      case Kind::parallel:
        make(query, Shape::parallel, anyPath(), 1, 0, power(-3, 0), power(-14, 0));
        break;
      case Kind::degenerate:
        make(query, Shape::degenerate, anyPath(), 1, 0, power(-3, 0), power(-14, 0));
        break;
      case Kind::far:
        make(query, anyShape(), anyPath(), 1, power(0, 6), power(-3, 0), power(-10, 0));
        break;
      case Kind::scaled:
        make(query, anyShape(), anyPath(), power(-6, 6), 0, power(-3, 0), power(-14, 0));
        break;
      case Kind::simulation:
        simulation(query);
        break;
      case Kind::turning:
        make(query, anyShape(), Path::turning, 1, 0, power(-3, 0), power(-8, 0));
        break;
      case Kind::mixed: {
        const double scale = power(-6, 6);
        make(query, anyShape(), anyPath(), scale, below(2) == 0 ? 0 : power(-6, 6), power(-6, 3),
             power(-15, 2));
        break;
      }
      case Kind::extreme: {
        const double scale = power(-300, 300);
        make(query, anyShape(), anyPath(), scale, 0, power(-6, 0), power(-15, 2));
        if (below(3) == 0) shrinkSome(query.motion);
      }
    }
    return query;
  }

 private:
  enum class Shape { any, parallel, degenerate };
  enum class Path { any, common, towards, grazing, tilting, turning, rest };

  int below(int n) { return static_cast<int>(random_.bits() % static_cast<std::uint64_t>(n)); }
  double power(double low, double high) { return std::pow(10., random_.uniform(low, high)); }
  Vector3 vector() { return {random_.uniform(-1, 1), random_.uniform(-1, 1), random_.uniform(-1, 1)}; }
  /// On a coarse grid, where sums and products are exact.
  Vector3 gridVector() { return Vector3(below(17) - 8, below(17) - 8, below(17) - 8) / 8; }
  Shape anyShape() { return static_cast<Shape>(below(3)); }
  Path anyPath() { return static_cast<Path>(below(7)); }

  /// Corners about 1 in size.
  void shape(exact::Motion& m, Shape shape) {
    const bool grid = below(2) == 0;
    const auto draw = [&] { return grid ? gridVector() : vector(); };
    for (Vector3& p : m.p) p = shape == Shape::any ? vector() : draw();
    for (Vector3& q : m.q) q = shape == Shape::any ? vector() : draw();
    if (shape == Shape::parallel) {
      const double length = below(2) == 0 ? 1 : 0.25 * (1 + below(8));
      switch (below(3)) {
        case 0:
          m.p[1] = m.p[0] + length * (m.q[1] - m.q[0]);
          break;
        case 1:
          m.p[1] = m.p[0] - length * (m.q[1] - m.q[0]);
          break;
        default:
          m.p[1] = m.p[0] + 0.5 * (m.q[1] - m.q[0]) + 0.25 * (m.q[2] - m.q[0]);  // to the plane
      }
      if (below(3) == 0) m.p[1] += power(-16, -3) * vector();
    }
    if (shape == Shape::degenerate) {
      const double thin = below(3) == 0 ? 0 : power(-16, -4);
      if (below(2) == 0) m.p[1] = m.p[0] + thin * vector();
      switch (below(5)) {
        case 0:
          m.q[1] = m.q[0] + thin * vector();
          break;
        case 1:
          m.q[2] = m.q[1] + thin * vector();
          break;
        case 2:
          m.q[2] = m.q[0] + 0.125 * below(17) * (m.q[1] - m.q[0]) + thin * vector();
          break;  // collinear
        case 3:
          m.q[1] = m.q[0] + thin * vector(), m.q[2] = m.q[0] + thin * vector();
          break;
        default:
          break;
      }
    }
  }

  /// `size`: of the shape [m]; `offset`: of its place; radius and gap in units of the size, or gap of the
  /// radius.
  void make(Query& query, Shape kind, Path path, double size, double offset, double radius, double gap) {
    exact::Motion& m = query.motion;
    shape(m, kind);
    const Vector3 place = offset * vector();
    for (Vector3& p : m.p) p = size * p + place;
    for (Vector3& q : m.q) q = size * q + place;
    query.radius = size * radius;
    const double distance = query.radius * (1 + gap);
    Vector3 n = separate(m, distance);
    move(m, path, size, distance - query.radius, n);
    if (query.pair != Pair::segment_segment) m.dq.fill(Vector3::Zero());
  }

  /// Shifts P along the line through the nearest points so that the distance becomes `distance`.
  Vector3 separate(exact::Motion& m, double distance) {
    const V apart = Moment(m, 0).apart();
    const Real length = apart.norm();
    if (!(length > 0)) return vector().normalized();
    const V n = apart / length;
    const V shift = (distance - length) * n;
    for (Vector3& p : m.p) p = (p.cast<Real>() + shift).cast<double>();
    return n.cast<double>();
  }

  void move(exact::Motion& m, Path path, double size, double gap, const Vector3& n) {
    const double speed = size * power(-6, below(4) == 0 ? 6 : 2);
    const auto each = [&](const auto& draw) {
      for (Vector3& d : m.dp) d = draw();
      for (Vector3& d : m.dq) d = draw();
    };
    switch (path) {
      case Path::any:
        each([&] { return Vector3(speed * vector()); });
        break;
      case Path::common: {
        const Vector3 d = speed * (below(2) == 0 ? vector() : gridVector());
        m.dp.fill(d);
        m.dq.fill(below(2) == 0 ? d : Vector3(speed * vector()));
        break;
      }
      case Path::towards: {
        const double reach = gap * power(-1, 2);
        m.dp.fill(-reach * n);
        m.dq.fill(below(2) == 0 ? Vector3::Zero() : Vector3(reach * n));
        if (below(2) == 0) m.dp[0] += reach * vector();
        break;
      }
      case Path::grazing: {  // across n, and towards it by about the gap
        const bool together = below(2) == 0;
        const Vector3 common = speed * vector();
        each([&] {
          const Vector3 d = together ? common : Vector3(speed * vector());
          return Vector3(d - n * n.dot(d) + random_.uniform(-2, 2) * gap * n);
        });
        break;
      }
      case Path::tilting: {
        const double tilt = speed * power(-12, -1);
        const Vector3 d =
            below(2) == 0 ? Vector3(speed * vector()) : Vector3(-gap * random_.uniform(0, 2) * n);
        each([&] { return Vector3(tilt * vector()); });
        for (Vector3& dp : m.dp) dp += d;
        break;
      }
      case Path::turning: {  // like one rigid body, nearly
        const Vector3 omega = power(-3, 0.5) * vector(), centre = m.q[0] + size * vector();
        for (std::size_t i = 0; i < 2; ++i) m.dp[i] = omega.cross(m.p[i] - centre) + gap * vector();
        for (std::size_t i = 0; i < 3; ++i) m.dq[i] = omega.cross(m.q[i] - centre);
        break;
      }
      case Path::rest:
        each([&] { return Vector3(Vector3::Zero()); });
        break;
    }
    if (path != Path::rest && below(8) == 0) m.dp[static_cast<std::size_t>(below(2))].setZero();
  }

  /// Coordinates of every order of magnitude, down to subnormal ones.
  void shrinkSome(exact::Motion& m) {
    const auto shrink = [&](Vector3& x) {
      if (below(2) == 0) x[below(3)] *= power(-320, 0);
    };
    for (Vector3& x : m.p) shrink(x);
    for (Vector3& x : m.dp) shrink(x);
    for (Vector3& x : m.q) shrink(x);
  }

  /// A rod's elements of a few centimetres, at gaps and steps as in a simulation with a barrier.
  void simulation(Query& query) {
    exact::Motion& m = query.motion;
    const double element = power(-2, -1);
    const Vector3 place = vector();
    m.p[0] = place, m.p[1] = place + element * vector().normalized();
    const double face = query.pair == Pair::segment_segment ? element : power(-2, 0.5);
    for (Vector3& q : m.q) q = place + face * vector();
    query.radius = element * power(-1.5, -0.5);
    query.keep = 0.1;
    const double gap = query.radius * power(-7, 0);
    const Vector3 n = separate(m, query.radius + gap);
    const double step = power(-6, -1.5);
    const Vector3 common = step * vector();
    for (Vector3& d : m.dp) d = common + 0.3 * step * vector() - random_.uniform(-1, 2) * gap * n;
    for (Vector3& d : m.dq)
      d = query.pair == Pair::segment_segment ? Vector3(step * vector()) : Vector3(Vector3::Zero());
  }

  Random random_;
};

}  // namespace tendril::motion_queries
