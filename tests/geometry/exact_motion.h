/// Do two bodies that move linearly ever come nearer than a radius? Decided in exact arithmetic on the given
/// doubles.
///
/// The bodies are convex hulls of at most two and three moving corners. At every moment their nearest points,
/// unless the bodies meet, are the nearest points of the affine hulls of two features (vertex, edge, face)
/// that lie inside these features; and whenever such points lie inside, they are points of the bodies. So the
/// distance falls below r within [0, f] just if, for some pair of features and some moment,
///
///     G < 0 and all C_k >= 0,
///
/// with polynomials in time of degree at most six: G is the squared distance of the affine hulls minus r^2,
/// times its positive denominator, and the C_k say that the nearest points lie inside. (With G = 0 throughout
/// where the affine hulls are parallel or degenerate: then smaller features hold the nearest points too.)
/// Bodies that meet have been at smaller distances than r before, or meet at the start, which is tested.
///
/// Every G and C_k is held as integer coefficients in Bernstein's basis on an interval of time: a polynomial
/// with no negative coefficient is nowhere negative there, and the first and the last coefficient are its
/// values at the ends. Intervals are halved until each pair of features is settled: G >= 0, or some C_k < 0,
/// or an end where G < 0 and all C_k >= 0. Where G and all C_k vanish together (edges that are parallel for a
/// moment) this would go on for ever; of an interval that is left after 80 halvings it is shown that the
/// distance at one end is at least r plus all that the corners move meanwhile. Undecided remains what comes
/// nearer to r than that and does not fall below it.
#pragma once

#include <gmpxx.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "tendril/base.h"

namespace tendril::exact {

/// Corner i of P is at p[i] + t dp[i], corner j of Q at q[j] + t dq[j]. np is 1 or 2, nq is 2 or 3.
struct Motion {
  using Two = std::array<Vector3, 2>;
  using Three = std::array<Vector3, 3>;

  int np, nq;
  Two p = {Vector3::Zero(), Vector3::Zero()}, dp = p;
  Three q = {Vector3::Zero(), Vector3::Zero(), Vector3::Zero()}, dq = q;
};

enum class Verdict { free, hit, undecided };

/// Coefficients of sigma^(n-i) tau^i, where tau runs from 0 to 1 over an interval and sigma = 1 - tau: n over
/// i times Bernstein's coefficients, so that products are convolutions.
using Polynomial = std::vector<mpz_class>;

inline Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  Polynomial c(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      mpz_addmul(c[i + j].get_mpz_t(), a[i].get_mpz_t(), b[j].get_mpz_t());
  return c;
}

/// The same polynomial one degree higher: times sigma + tau.
inline void elevate(Polynomial& a) {
  a.emplace_back(0);
  for (std::size_t i = a.size() - 1; i > 0; --i) a[i] += a[i - 1];
}

inline Polynomial sum(Polynomial a, Polynomial b, int sign) {
  while (a.size() < b.size()) elevate(a);
  while (b.size() < a.size()) elevate(b);
  for (std::size_t i = 0; i < a.size(); ++i) sign > 0 ? a[i] += b[i] : a[i] -= b[i];
  return a;
}
inline Polynomial operator+(const Polynomial& a, const Polynomial& b) { return sum(a, b, 1); }
inline Polynomial operator-(const Polynomial& a, const Polynomial& b) { return sum(a, b, -1); }

/// On the first half of the interval, times 2^n: sigma becomes 2 sigma + tau. Of the reversed coefficients,
/// it gives those of the second half, reversed.
inline Polynomial firstHalf(Polynomial a) {
  const std::size_t n = a.size() - 1;
  for (std::size_t last = n; last >= 1; --last)
    for (std::size_t i = 1; i <= last; ++i) a[i] += a[i - 1];
  for (std::size_t i = 0; i < n; ++i) a[i] <<= n - i;
  return a;
}

using Vector = std::array<Polynomial, 3>;

inline Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Polynomial dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// A double as an integer times a power of two.
struct Dyadic {
  mpz_class mantissa;
  long exponent;
};
inline Dyadic dyadic(double x) {
  int exponent = 0;
  const double fraction = std::frexp(x, &exponent);
  return {mpz_class(std::ldexp(fraction, 53)), exponent - 53L};
}
inline mpz_class inUnits(const Dyadic& x, long unit) {
  return x.mantissa << static_cast<mp_bitcnt_t>(x.exponent - unit);
}

/// The motion over [0, f], in units of a power of two of which all numbers are multiples.
struct ExactMotion {
  std::vector<Vector> p, q;
  mpz_class r;

  ExactMotion(const Motion& motion, double f, double radius) {
    const Dyadic fraction = dyadic(f);
    long unit = dyadic(radius).exponent;
    const auto include = [&](const Vector3& x, const Vector3& dx) {
      for (int k = 0; k < 3; ++k) {
        if (x[k] != 0) unit = std::min(unit, dyadic(x[k]).exponent);
        if (dx[k] != 0 && f != 0) unit = std::min(unit, dyadic(dx[k]).exponent + fraction.exponent);
      }
    };
    const auto corner = [&](const Vector3& x, const Vector3& dx) {
      Vector result;
      for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(k);
        result[i] = {x[k] == 0 ? mpz_class(0) : inUnits(dyadic(x[k]), unit)};
        if (dx[k] == 0 || f == 0) continue;
        Dyadic step = dyadic(dx[k]);
        step.mantissa *= fraction.mantissa, step.exponent += fraction.exponent;
        result[i].push_back(result[i][0] + inUnits(step, unit));
      }
      return result;
    };
    for (std::size_t i = 0; i < static_cast<std::size_t>(motion.np); ++i) include(motion.p[i], motion.dp[i]);
    for (std::size_t i = 0; i < static_cast<std::size_t>(motion.nq); ++i) include(motion.q[i], motion.dq[i]);
    for (std::size_t i = 0; i < static_cast<std::size_t>(motion.np); ++i)
      p.push_back(corner(motion.p[i], motion.dp[i]));
    for (std::size_t i = 0; i < static_cast<std::size_t>(motion.nq); ++i)
      q.push_back(corner(motion.q[i], motion.dq[i]));
    r = inUnits(dyadic(radius), unit);
  }

  /// At rest as it is at the moment k / 2^halvings, in units 2^-halvings as large.
  ExactMotion(const ExactMotion& motion, const mpz_class& k, mp_bitcnt_t halvings) : r(motion.r << halvings) {
    const auto at = [&](const std::vector<Vector>& corners) {
      std::vector<Vector> result = corners;
      for (Vector& corner : result)
        for (Polynomial& x : corner) x = {(x.front() << halvings) + (x.back() - x.front()) * k};
      return result;
    };
    p = at(motion.p), q = at(motion.q);
  }

  /// Not less than what any corner of P moves relative to any of Q.
  [[nodiscard]] mpz_class path() const {
    mpz_class longest2 = 0;
    for (const Vector& x : p)
      for (const Vector& y : q) {
        mpz_class length2 = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const mpz_class d = x[k].back() - x[k].front() - y[k].back() + y[k].front();
          length2 += d * d;
        }
        longest2 = std::max(longest2, length2);
      }
    return sqrt(longest2) + 1;
  }
};

/// The pairs of features of one motion: what is settled, and what is left.
class Search {
 public:
  static constexpr mp_bitcnt_t kHalvings = 80;

  bool hit = false;
  std::vector<mpz_class> left;  // the intervals [k, k + 1] / 2^kHalvings that are not settled

  /// Is there a moment of [k, k + 1] / 2^halvings with g < 0 and all c >= 0?
  void operator()(const Polynomial& g, std::vector<Polynomial> c, mp_bitcnt_t halvings = 0,
                  const mpz_class& k = 0) {
    const auto not_negative = [](const mpz_class& x) { return sgn(x) >= 0; };
    const auto not_positive = [](const mpz_class& x) { return sgn(x) <= 0; };
    if (hit || std::all_of(g.begin(), g.end(), not_negative)) return;
    bool first = sgn(g.front()) < 0, last = sgn(g.back()) < 0;
    for (const Polynomial& x : c) {
      const bool negative_first = sgn(x.front()) < 0, negative_last = sgn(x.back()) < 0;
      if (negative_first && negative_last && std::all_of(x.begin(), x.end(), not_positive)) return;
      first &= !negative_first, last &= !negative_last;
    }
    if (first || last) {
      hit = true;
    } else if (halvings == kHalvings) {
      left.push_back(k);
    } else {
      std::erase_if(c, [&](const Polynomial& x) { return std::all_of(x.begin(), x.end(), not_negative); });
      for (const bool second : {true, false}) {
        const auto half = [second](Polynomial x) {
          if (second) std::reverse(x.begin(), x.end());
          x = firstHalf(std::move(x));
          if (second) std::reverse(x.begin(), x.end());
          return x;
        };
        std::vector<Polynomial> c_half;
        for (const Polynomial& x : c) c_half.push_back(half(x));
        (*this)(half(g), std::move(c_half), halvings + 1, 2 * k + (second ? 1 : 0));
      }
    }
  }
};

inline void vertexVertex(Search& search, const Vector& p, const Vector& q, const Polynomial& r2) {
  const Vector w = p - q;
  search(dot(w, w) - r2, {});
}

inline void vertexEdge(Search& search, const Vector& p, const Vector& a, const Vector& b,
                       const Polynomial& r2) {
  const Vector e = b - a, w = p - a, n = cross(w, e);
  const Polynomial e2 = dot(e, e), along = dot(w, e);
  search(dot(n, n) - r2 * e2, {along, e2 - along});
}

inline void edgeEdge(Search& search, const Vector& p0, const Vector& p1, const Vector& q0, const Vector& q1,
                     const Polynomial& r2) {
  const Vector d = p1 - p0, e = q1 - q0, w = q0 - p0, n = cross(d, e);
  const Polynomial n2 = dot(n, n), height = dot(w, n);
  const Polynomial s = dot(cross(w, e), n), t = dot(cross(w, d), n);  // the parameters, times n^2
  search(height * height - r2 * n2, {s, n2 - s, t, n2 - t});
}

/// The weights of a, b, c at the projection of p on their plane, times n^2.
struct Weights {
  Polynomial a, b, c;
};
inline Weights weights(const Vector& p, const std::vector<Vector>& abc, const Vector& n) {
  const Vector w = p - abc[0];
  Weights result;
  result.b = dot(n, cross(w, abc[2] - abc[0]));
  result.c = dot(n, cross(abc[1] - abc[0], w));
  result.a = dot(n, n) - result.b - result.c;
  return result;
}

inline void vertexFace(Search& search, const Vector& p, const std::vector<Vector>& abc,
                       const Polynomial& r2) {
  const Vector n = cross(abc[1] - abc[0], abc[2] - abc[0]);
  const Polynomial height = dot(p - abc[0], n);
  const Weights inside = weights(p, abc, n);
  search(height * height - r2 * dot(n, n), {inside.a, inside.b, inside.c});
}

/// Does the segment cross the triangle at the start, with its ends on different sides?
inline bool crossesAtStart(const std::vector<Vector>& segment, const std::vector<Vector>& triangle) {
  const auto at_start = [](Vector x) {
    for (Polynomial& k : x) k.resize(1);
    return x;
  };
  const Vector p0 = at_start(segment[0]), p1 = at_start(segment[1]);
  const std::vector<Vector> abc = {at_start(triangle[0]), at_start(triangle[1]), at_start(triangle[2])};
  const Vector n = cross(abc[1] - abc[0], abc[2] - abc[0]);
  const mpz_class side0 = dot(p0 - abc[0], n)[0], side1 = dot(p1 - abc[0], n)[0];
  if (sgn(side0) * sgn(side1) >= 0) return false;
  const Weights start = weights(p0, abc, n), end = weights(p1, abc, n);
  const auto inside = [&](const Polynomial& x, const Polynomial& y) {
    return mpz_class(x[0] * abs(side1) + y[0] * abs(side0)) >= 0;
  };
  return inside(start.a, end.a) && inside(start.b, end.b) && inside(start.c, end.c);
}

/// All pairs of features, at distance r.
inline Search searchAll(const ExactMotion& motion, const mpz_class& r) {
  const auto& p = motion.p;
  const auto& q = motion.q;
  const Polynomial r2 = {r * r};
  const std::size_t np = p.size(), nq = q.size(), p_edges = np - 1, q_edges = nq == 3 ? 3 : 1;
  Search search;
  for (const Vector& x : p)
    for (const Vector& y : q) vertexVertex(search, x, y, r2);
  for (std::size_t j = 0; j < q_edges; ++j) {
    for (const Vector& x : p) vertexEdge(search, x, q[j], q[(j + 1) % nq], r2);
    if (p_edges == 1) edgeEdge(search, p[0], p[1], q[j], q[(j + 1) % nq], r2);
  }
  if (p_edges == 1)
    for (const Vector& y : q) vertexEdge(search, y, p[0], p[1], r2);
  if (nq == 3)
    for (const Vector& x : p) vertexFace(search, x, q, r2);
  if (p_edges == 1 && nq == 3) search.hit |= crossesAtStart(p, q);
  return search;
}

/// Is the distance at least `radius` (>= 0) at every moment of [0, f]?
inline Verdict decide(const Motion& motion, double f, double radius) {
  const ExactMotion exact(motion, f, radius);
  const Search search = searchAll(exact, exact.r);
  if (search.hit) return Verdict::hit;
  for (const mpz_class& k : search.left) {
    const ExactMotion at_rest(exact, k, Search::kHalvings);
    if (searchAll(at_rest, at_rest.r).hit) return Verdict::hit;
    if (searchAll(at_rest, at_rest.r + exact.path()).hit) return Verdict::undecided;
  }
  return Verdict::free;
}

}  // namespace tendril::exact
