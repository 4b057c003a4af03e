/// References for the dynamics that share none of its formulas: the Cosserat rod at rest by multiple
/// shooting, a planar rod in motion by explicit finite differences, and the stability of a planar hanging
/// rod.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "tendril/rod.h"

namespace tendril::reference {

/// A cross-section of a rod at rest: frame, and internal moment [N m] and force [N] in that frame.
struct Section {
  Quaternion rotation = Quaternion::Identity();
  Vector3 p = Vector3::Zero(), m = Vector3::Zero(), n = Vector3::Zero();
};

/// A rod of constant stiffness and curvature at rest under a load per length [N/m, world].
struct Rod {
  double length = 1;
  Vector6 c = Vector6::Ones();
  Vector3 rest_curvature = Vector3::Zero();
  Vector3 load = Vector3::Zero();
};

inline Rod rodOf(const RodProperties& rod, const Vector3& gravity) {
  const double mass = rod.density * std::numbers::pi * rod.radius * rod.radius;
  return {rod.length, rod.c, rod.restCurvature(0), mass * gravity};
}

/// The section `ds` farther along: R' = R kappa^, p' = R v, m' = m x kappa + n x v, n' = n x kappa - R^T
/// load, with kappa = kappa0 + m/c, v = e1 + n/c, by the classical Runge-Kutta method.
inline Section advance(const Rod& rod, Section x, double ds, int steps) {
  struct Rate {
    Eigen::Vector4d q;
    Vector3 p, m, n;
  };
  const auto rate = [&](const Section& at) {
    const Vector3 kappa = rod.rest_curvature + at.m.cwiseQuotient(rod.c.head<3>());
    const Vector3 v = Vector3::UnitX() + at.n.cwiseQuotient(rod.c.tail<3>());
    const Quaternion q = at.rotation.normalized();
    const Quaternion dq = at.rotation * Quaternion(0, kappa.x() / 2, kappa.y() / 2, kappa.z() / 2);
    return Rate{dq.coeffs(), q * v, at.m.cross(kappa) + at.n.cross(v),
                at.n.cross(kappa) - q.conjugate() * rod.load};
  };
  const auto shifted = [](const Section& at, double h, const Rate& by) {
    Section y = at;
    y.rotation.coeffs() += h * by.q;
    y.p += h * by.p, y.m += h * by.m, y.n += h * by.n;
    return y;
  };
  const double h = ds / steps;
  for (int k = 0; k < steps; ++k) {
    const Rate a = rate(x), b = rate(shifted(x, h / 2, a)), c = rate(shifted(x, h / 2, b)),
               d = rate(shifted(x, h, c));
    x.rotation.coeffs() += h / 6 * (a.q + 2 * b.q + 2 * c.q + d.q);
    x.p += h / 6 * (a.p + 2 * b.p + 2 * c.p + d.p);
    x.m += h / 6 * (a.m + 2 * b.m + 2 * c.m + d.m);
    x.n += h / 6 * (a.n + 2 * b.n + 2 * c.n + d.n);
    x.rotation.normalize();
  }
  return x;
}

inline constexpr int kSegments = 20, kStepsPerSegment = 80;

/// What Newton's method starts from: frames and elastic wrenches of a discrete rod, at the ends of
/// kSegments equal pieces.
inline std::vector<Section> guessFrom(const RodProperties& rod, const RodShape& shape) {
  const int elements = static_cast<int>(shape.size()) - 1;
  const RodProperties cut = withElements(rod, elements);
  const double h = cut.elementLength();
  Vector6 c = cut.c;  // to its shear force an element gives way by bending within it, mostly
  c[4] = 1 / (1 / c[4] + h * h / (12 * c[2])), c[5] = 1 / (1 / c[5] + h * h / (12 * c[1]));
  const auto wrench = [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    Vector6 u = logSE3(shape[i].inverse() * shape[i + 1]) / h;
    u[3] -= 1;
    u.head<3>() -= cut.restCurvature(k);
    return Vector6(u.cwiseProduct(c));
  };
  const RodShape at = resample(shape, kSegments);
  std::vector<Section> out;
  for (int k = 0; k <= kSegments; ++k) {
    const int i = k * elements / kSegments;
    const Vector6 mu = 0.5 * (wrench(std::max(0, i - 1)) + wrench(std::min(elements - 1, i)));
    const Pose& q = at[static_cast<std::size_t>(k)];
    out.push_back({q.rotation, q.position, mu.head<3>(), mu.tail<3>()});
  }
  return out;
}

/// The rod from `base` whose far end is free (no wrench), or held at `end`, near `guess`: sections at the
/// ends of kSegments pieces. Empty if Newton's method does not arrive at a residual of 1e-9 (L, rad, EI/L,
/// EI/L^2).
inline std::vector<Section> solve(const Rod& rod, const Pose& base, const std::optional<Pose>& end,
                                  std::vector<Section> x) {
  using Vector12 = Eigen::Matrix<double, 12, 1>;
  constexpr int n = 12 * kSegments;
  const double l = rod.length, ei = 0.5 * (rod.c[1] + rod.c[2]), ds = l / kSegments;
  const auto difference = [&](const Section& a, const Section& b) {  // b - a, in the rod's units
    Vector12 d;
    d << logSO3(a.rotation.conjugate() * b.rotation), (b.p - a.p) / l, (b.m - a.m) * l / ei,
        (b.n - a.n) * l * l / ei;
    return d;
  };
  const auto moved = [&](Section a, const Vector12& d) {
    a.rotation = (a.rotation * expSO3(d.head<3>())).normalized();
    a.p += l * d.segment<3>(3), a.m += ei / l * d.segment<3>(6), a.n += ei / (l * l) * d.tail<3>();
    return a;
  };
  const auto wantedEnd = [&](const Section& reached) {  // six numbers that vanish
    Vector6 r;
    if (end)
      r << logSO3(end->rotation.conjugate() * reached.rotation), (reached.p - end->position) / l;
    else
      r << reached.m * l / ei, reached.n * l * l / ei;
    return r;
  };
  const auto at = [&](int k) -> Section& { return x[static_cast<std::size_t>(k)]; };
  for (int iteration = 0; iteration < 40; ++iteration) {
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd residual(n);
    const Section start{base.rotation, base.position, at(0).m, at(0).n};
    at(0) = start;
    for (int i = 0; i < 6; ++i) jacobian(i, i) = 1;
    residual.head<6>().setZero();
    for (int k = 0; k < kSegments; ++k) {
      const bool last = k + 1 == kSegments;
      const Section reached = advance(rod, at(k), ds, kStepsPerSegment);
      const int row = 6 + 12 * k, rows = last ? 6 : 12;
      if (last) {
        at(k + 1) = reached;
        residual.tail<6>() = wantedEnd(reached);
      } else {
        residual.segment<12>(row) = difference(at(k + 1), reached);
        jacobian.block<12, 12>(row, 12 * (k + 1)) = -Eigen::Matrix<double, 12, 12>::Identity();
      }
      for (int j = 0; j < 12; ++j) {
        constexpr double kStep = 1e-6;
        const Section ahead = advance(rod, moved(at(k), kStep * Vector12::Unit(j)), ds, kStepsPerSegment);
        const Section behind = advance(rod, moved(at(k), -kStep * Vector12::Unit(j)), ds, kStepsPerSegment);
        if (last)
          jacobian.block(row, 12 * k + j, rows, 1) = (wantedEnd(ahead) - wantedEnd(behind)) / (2 * kStep);
        else
          jacobian.block(row, 12 * k + j, rows, 1) =
              (difference(at(k + 1), ahead) - difference(at(k + 1), behind)) / (2 * kStep);
      }
    }
    if (residual.cwiseAbs().maxCoeff() < 1e-9) return x;
    Eigen::VectorXd step = jacobian.partialPivLu().solve(-residual);
    double largest = 0;  // of rotation and place: a radian, half a length
    for (int k = 0; k < kSegments; ++k)
      largest = std::max(largest, step.segment<6>(12 * k).cwiseAbs().maxCoeff());
    step *= std::min(1.0, 0.5 / largest);
    for (int k = 0; k < kSegments; ++k) at(k) = moved(at(k), step.segment<12>(12 * k));
  }
  return {};
}

/// Frames of a solution at the ends of `elements` equal elements.
inline RodShape nodesOf(const Rod& rod, const std::vector<Section>& sections, int elements) {
  RodShape shape;
  for (int i = 0; i <= elements; ++i) {
    const double s = rod.length * i / elements, ds = rod.length / kSegments;
    const auto k = std::min(static_cast<std::size_t>(s / ds + 1e-9), sections.size() - 1);
    const double rest = s - static_cast<double>(k) * ds;
    const Section x = rest > 1e-12 ? advance(rod, sections[k], rest, kStepsPerSegment) : sections[k];
    shape.push_back({x.rotation, x.p});
  }
  return shape;
}

// ---------------------------------------------------------------------------------------------- in motion

/// The tip, at each of `times` [s], of a straight rod that is clamped along x at its first node and let go
/// under gravity along -z, without damping. Finite differences of second order in h (strain at the middle of
/// an element, the frame's angle there the mean), Verlet's method in time.
inline std::vector<Vector3> swingOfCantilever(const RodProperties& rod, double gravity, int elements,
                                              double dt, const std::vector<double>& times) {
  const auto n = static_cast<std::size_t>(elements);
  const double h = rod.length / elements, area = std::numbers::pi * rod.radius * rod.radius;
  const double mass = rod.density * area * h, inertia = mass * rod.radius * rod.radius / 4;
  std::vector<double> x(n + 1), z(n + 1, 0.0), a(n + 1, 0.0), vx(n + 1, 0.0), vz(n + 1, 0.0), va(n + 1, 0.0);
  std::vector<double> fx(n + 1), fz(n + 1), fa(n + 1);
  for (std::size_t i = 0; i <= n; ++i) x[i] = h * static_cast<double>(i);
  const auto forces = [&] {
    std::fill(fx.begin(), fx.end(), 0.0), std::fill(fz.begin(), fz.end(), 0.0),
        std::fill(fa.begin(), fa.end(), 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      const double dx = (x[i + 1] - x[i]) / h, dz = (z[i + 1] - z[i]) / h, angle = 0.5 * (a[i] + a[i + 1]);
      const double cs = std::cos(angle), sn = std::sin(angle);
      const double v1 = cs * dx + sn * dz, v3 = -sn * dx + cs * dz;
      const double axial = rod.c[3] * (v1 - 1), shear = rod.c[5] * v3,
                   moment = rod.c[1] * (a[i + 1] - a[i]) / h;
      const double gx = cs * axial - sn * shear, gz = sn * axial + cs * shear;
      const double couple = 0.5 * h * (shear * v1 - axial * v3);
      fx[i] += gx, fz[i] += gz, fa[i] += moment + couple;
      fx[i + 1] -= gx, fz[i + 1] -= gz, fa[i + 1] += couple - moment;
    }
  };
  const auto kick = [&](double time) {
    for (std::size_t i = 1; i <= n; ++i) {
      const double share = i == n ? 0.5 : 1;
      vx[i] += time * fx[i] / (share * mass), vz[i] += time * (fz[i] / (share * mass) - gravity);
      va[i] += time * fa[i] / (share * inertia);
    }
  };
  std::vector<Vector3> tips;
  forces();
  long done = 0;
  for (const double time : times) {
    for (const long until = std::lround(time / dt); done < until; ++done) {
      kick(dt / 2);
      for (std::size_t i = 1; i <= n; ++i) x[i] += dt * vx[i], z[i] += dt * vz[i], a[i] += dt * va[i];
      forces();
      kick(dt / 2);
    }
    tips.emplace_back(x[n], 0, z[n]);
  }
  return tips;
}

// ---------------------------------------------------------------------------------------------- stability

/// A rod without stretch and shear (EI = 1, L = 1) of curvature `curvature` at rest that hangs in the plane
/// of that curvature from a clamp, tangent downward, under the weight `weight` (rho A g L^3/EI).
struct PlanarHook {
  double curvature, weight, torsion;  // GJ/EI

  /// Integrated from the tip, whose tangent is at `tip_angle` from downward: the angle at the clamp, which
  /// should be 0, and the determinant of the map from the tip's rotations out of the plane (two: about the
  /// axes of the plane) to those at the clamp. The load does not turn, so the variation of the moment, M', is
  /// -(dtheta x t) x n, and dtheta' = C^-1 (M - dtheta x m) in the section's axes. It is 0 where the planar
  /// shape is marginal.
  struct AtClamp {
    double angle, determinant;
  };
  [[nodiscard]] AtClamp integrate(double tip_angle) const {
    using State = Eigen::Matrix<double, 10, 1>;  // angle, moment; twice (dtheta, M), each of two numbers
    const auto rate = [&](double from_tip, const State& y) {
      const double sn = std::sin(y[0]), cs = std::cos(y[0]), force = weight * from_tip;
      State out;
      out[0] = -(curvature + y[1]), out[1] = -force * sn;
      const Eigen::Vector2d tangent(sn, -cs), normal(cs, sn);
      for (const int j : {2, 6}) {
        const Eigen::Vector2d d = y.segment<2>(j), about(d.y() * y[1], -d.x() * y[1]);  // dtheta x m
        const Eigen::Vector2d moment = y.segment<2>(j + 2) - about;
        out.segment<2>(j) = -(tangent * moment.dot(tangent) / torsion + normal * moment.dot(normal));
        const double lift = d.x() * tangent.y() - d.y() * tangent.x();  // of dtheta x t, out of the plane
        // -(dtheta x t) x n, n = (0, -force, 0), with the sign of going from the tip
        out.segment<2>(j + 2) = Eigen::Vector2d(lift * force, 0);
      }
      return out;
    };
    State y = State::Zero();
    y[0] = tip_angle, y[2] = 1, y[7] = 1;
    constexpr int kSteps = 400;
    constexpr double h = 1.0 / kSteps;
    for (int k = 0; k < kSteps; ++k) {
      const double s = k * h;
      const State a = rate(s, y), b = rate(s + h / 2, y + h / 2 * a), c = rate(s + h / 2, y + h / 2 * b),
                  d = rate(s + h, y + h * c);
      y += h / 6 * (a + 2 * b + 2 * c + d);
    }
    return {y[0], y[2] * y[7] - y[3] * y[6]};
  }
};

/// Weights up to `most` at which the planar hanging curl is marginal, from its natural arc on.
inline std::vector<double> marginalWeights(double curvature, double torsion, double most) {
  std::vector<double> out;
  double tip = curvature;
  const auto determinantAt = [&](double weight) {
    const PlanarHook hook{curvature, weight, torsion};
    for (int k = 0; k < 50; ++k) {
      const double miss = hook.integrate(tip).angle, slope = (hook.integrate(tip + 1e-6).angle - miss) / 1e-6;
      const double by = std::clamp(-miss / slope, -0.2, 0.2);
      tip += by;
      if (std::abs(by) < 1e-9) break;
    }
    return hook.integrate(tip).determinant;
  };
  double last = determinantAt(0);
  for (double weight = 0; weight < most;) {
    const double next = weight + std::max(0.25, 0.02 * weight), now = determinantAt(next);
    if (now * last < 0) {
      double low = weight, high = next;
      for (int k = 0; k < 20; ++k) {
        const double middle = 0.5 * (low + high);
        (determinantAt(middle) * last < 0 ? high : low) = middle;
      }
      out.push_back(0.5 * (low + high));
    }
    last = now, weight = next;
  }
  return out;
}

}  // namespace tendril::reference
