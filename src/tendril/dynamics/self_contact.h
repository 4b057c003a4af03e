/// Contact of the rod with itself: pairs of elements farther apart along the rod than pi r. Private to
/// dynamics.
#pragma once

#include <vector>

#include "tendril/dynamics/barrier.h"
#include "tendril/dynamics/beam.h"
#include "tendril/dynamics/block_tridiagonal.h"
#include "tendril/geometry.h"

namespace tendril::contact {

/// Finds and evaluates the rod's contacts with itself; keeps its memory. The gap of two elements is the
/// distance of their centrelines less 2 r. There is no friction between the rod and itself.
class SelfContacts {
 public:
  /// `element_length` h and `radius` r in m.
  void prepare(double radius, double element_length, const Barrier& barrier);

  void findCandidates(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion);
  [[nodiscard]] double freeFraction(const std::vector<Vector3>& positions, const std::vector<Vector3>& motion,
                                    KeptGap keep) const;
  [[nodiscard]] bool evaluate(const std::vector<Vector3>& positions);
  [[nodiscard]] double energy() const;
  /// The smallest gap of a term [m]; infinity if there is none.
  [[nodiscard]] double leastGap() const;
  /// The Hessian keeps each side's own blocks, doubled: (a - b)^2 <= 2 a^2 + 2 b^2 keeps the system
  /// block-tridiagonal and positive, at the price of linear convergence.
  void addDerivatives(const std::vector<beam::Node>& nodes, BlockTridiagonal& system) const;
  [[nodiscard]] std::size_t activeTerms() const { return terms_.size(); }

  struct Term {
    int i, j;
    double s, t;                       // where on them
    Vector3 normal;                    // from j to i, unit
    double distance;                   // m
    double weight;                     // the mollifier, see contact.cpp
    Vector3 weight_by_u, weight_by_v;  // its gradient by the direction vectors of i and j, 1/m
  };
  [[nodiscard]] const std::vector<Term>& terms() const { return terms_; }
  /// What a term pushes either element with [N]: i along its normal, j against it.
  [[nodiscard]] double normalForce(const Term& term) const {
    return -term.weight * barrier_(term.distance - 2 * radius_).slope;
  }

 private:
  struct Pair {
    int i, j;  // elements, i < j
  };
  void add(const Pair& pair, double s, double t, const Vector3& apart, double distance, double weight,
           const Vector3& weight_by_u, const Vector3& weight_by_v);

  double radius_ = 0;
  int least_apart_ = 2;  // j - i of the nearest pair that counts
  Barrier barrier_;
  std::vector<Aabb> boxes_;
  std::vector<int> order_;
  std::vector<Pair> candidates_;
  std::vector<Term> terms_;
};

}  // namespace tendril::contact
