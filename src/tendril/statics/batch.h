/// Many rods at once, in the rod's own units. Private to the statics.
#pragma once

#include <algorithm>
#include <limits>
#include <span>

#include "tendril/statics/integrator.h"

namespace tendril::statics {

/// Keeps its memory between calls; one per thread. Rods that the kernels for many cannot work on (an uneven
/// curvature at rest, nearly inverted) are done one by one; none is heavy.
class Batch {
 public:
  explicit Batch(const NaturalRod& rod) : single_(rod) {}
  [[nodiscard]] const NaturalRod& rod() const { return single_.rod(); }

  /// with(i, end) for every wrench: frame and energy alone; energy infinite if inverted.
  template <class With>
  void paths(std::span<const Vector6> wrenches, const Accuracy& accuracy, const With& with) {
    forChunks(
        wrenches, accuracy, [&](std::size_t i) { with(i, alone(wrenches[i], accuracy)); },
        [&] {
          paths_.resize(aligned_.size());
          kernel().paths(rod().kernel, aligned_, paths_.data());
          NaturalEnd end;
          for (std::size_t k = 0; k < aligned_.size(); ++k) {
            const Quaternion back =
                Quaternion(Eigen::Map<const Quaternion>(aligned_[k].rotation)).conjugate();
            end.end.rotation = back * Quaternion(Eigen::Map<const Quaternion>(paths_[k].rotation));
            end.end.position = back * Vector3::Map(paths_[k].position);
            end.energy = paths_[k].energy;
            with(index_[k], end);
          }
        });
  }
  /// with(i, end) for every wrench, with Jacobian and verdict; energy infinite if inverted. `stop`: of an
  /// unstable rod the verdict alone.
  template <class With>
  void ends(std::span<const Vector6> wrenches, const Accuracy& accuracy, bool stop, const With& with) {
    forChunks(
        wrenches, accuracy, [&](std::size_t i) { with(i, alone(wrenches[i], accuracy)); },
        [&] {
          joints_.resize(aligned_.size());
          kernel().joints(rod().kernel, aligned_, accuracy.margin, stop, joints_.data());
          lookAgain(wrenches);
          NaturalEnd end;
          for (std::size_t k = 0; k < aligned_.size(); ++k) {
            const bool stable = joints_[k].screening == Screening::stable;
            if (stable || !stop) Integrator::fromKernel(aligned_[k], joints_[k], end);
            end.stable = stable;
            with(index_[k], end);
          }
        });
  }
  /// with(i, stable) for every wrench.
  template <class With>
  void verdicts(std::span<const Vector6> wrenches, const With& with) {
    forChunks(
        wrenches, kScreening, [&](std::size_t i) { with(i, single_.isStable(wrenches[i], Vector3::Zero())); },
        [&] {
          joints_.resize(aligned_.size());
          kernel().joints(rod().kernel, aligned_, kScreening.margin, true, joints_.data());
          lookAgain(wrenches);
          for (std::size_t k = 0; k < aligned_.size(); ++k)
            with(index_[k], joints_[k].screening == Screening::stable);
        });
  }

 private:
  /// Rods worked on at a time: what is in between stays in the processor's second cache.
  static constexpr std::size_t kChunk = 512;
  /// So many are done sooner one by one.
  static constexpr std::size_t kFew = 2;

  /// Chunk by chunk, lays out the rods for the kernels and calls together(); calls alone(i) for every other.
  template <class Alone, class Together>
  void forChunks(std::span<const Vector6> wrenches, const Accuracy& accuracy, const Alone& alone,
                 const Together& together) {
    for (std::size_t first = 0; first < wrenches.size(); first += kChunk) {
      aligned_.clear(), index_.clear();
      for (std::size_t i = first; i < std::min(first + kChunk, wrenches.size()); ++i) {
        if (single_.canScreen(wrenches[i]))
          aligned_.push_back(aligned(wrenches[i], rod().stepCount(wrenches[i], accuracy))),
              index_.push_back(i);
        else
          alone(i);
      }
      together();
    }
  }
  /// Settles what the screening of this chunk left unsure.
  void lookAgain(std::span<const Vector6> wrenches) {
    unsure_.clear();
    for (std::size_t k = 0; k < joints_.size(); ++k)
      if (joints_[k].screening == Screening::unsure) unsure_.push_back(k);
    const auto wrench = [&](std::size_t i) -> const Vector6& { return wrenches[index_[unsure_[i]]]; };
    const auto settle = [&](std::size_t i, bool stable) {
      joints_[unsure_[i]].screening = stable ? Screening::stable : Screening::unstable;
    };
    if (unsure_.size() <= kFew) {
      for (std::size_t i = 0; i < unsure_.size(); ++i) settle(i, single_.isStableAtSecondLook(wrench(i)));
      return;
    }
    closer_.clear(), closer_ends_.resize(unsure_.size());
    for (std::size_t i = 0; i < unsure_.size(); ++i)
      closer_.push_back(aligned(wrench(i), rod().stepCount(wrench(i), kSecondLook)));
    kernel().joints(rod().kernel, closer_, kSecondLook.margin, true, closer_ends_.data());
    for (std::size_t i = 0; i < unsure_.size(); ++i)
      settle(i, closer_ends_[i].screening == Screening::unsure
                    ? single_.isStableByFineWalk(wrench(i), Vector3::Zero())
                    : closer_ends_[i].screening == Screening::stable);
  }
  [[nodiscard]] NaturalEnd alone(const Vector6& a, const Accuracy& accuracy) {
    NaturalEnd end;
    if (single_.end(a, Vector3::Zero(), accuracy, end) == ChartStatus::inverted) {
      end = {};
      end.energy = std::numeric_limits<double>::infinity();
    }
    return end;
  }

  Integrator single_;
  std::vector<AlignedWrench> aligned_;
  std::vector<std::size_t> index_;  // of each of them among those asked for
  std::vector<PathEnd> paths_;
  std::vector<JointEnd> joints_;
  std::vector<AlignedWrench> closer_;  // the second look
  std::vector<std::size_t> unsure_;    // of each of them among joints_
  std::vector<JointEnd> closer_ends_;
};

}  // namespace tendril::statics
