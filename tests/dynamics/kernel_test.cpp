/// The kernels of a step: the same bits on every instruction set, and the formulas of base and beam.h.
#include "tendril/dynamics/kernel.h"

#include <gtest/gtest.h>

#include <cstring>

#include "tendril/dynamics/workspace.h"

namespace tendril {
namespace {

/// A rod of frames at random, its elements bent by up to about `bend` rad.
std::vector<Node> randomRod(Random& random, int elements, double h, double bend) {
  const auto vector = [&](double size) {
    return Vector3(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
  };
  std::vector<Node> nodes(static_cast<std::size_t>(elements) + 1);
  nodes[0].pose = {random.rotation(), vector(1)};
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    Vector6 psi;
    psi << vector(bend * random.uniform()), h * (Vector3::UnitX() + vector(0.05));
    nodes[i].pose = nodes[i - 1].pose * expSE3(psi);
    if (random.uniform() < 0.5) nodes[i].pose.rotation.coeffs() *= -1;  // the same rotation
  }
  for (Node& node : nodes) node.rotation = node.pose.rotation.toRotationMatrix();
  return nodes;
}

/// Everything the kernels say of a rod, one number after the other.
struct Said {
  Table psi, elastic, wrench;
  std::vector<double> all;
};
Said whatIsSaid(const dynamics::Kernel& kernel, const std::vector<Node>& nodes, double h, bool geometric) {
  const std::size_t elements = nodes.size() - 1;
  const auto count = static_cast<int>(elements);
  Table frames, rest, hat;
  Said said;
  frames.resize(7, nodes.size()), rest.resize(3, elements), hat.resize(6, elements);
  said.psi.resize(6, elements), said.elastic.resize(8, elements), said.wrench.resize(6, elements);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (int j = 0; j < 4; ++j) frames.at(j, i) = nodes[i].pose.rotation.coeffs()[j];
    for (int j = 0; j < 3; ++j) frames.at(4 + j, i) = nodes[i].pose.position[j];
  }
  for (std::size_t k = 0; k < elements; ++k) {
    for (int j = 0; j < 3; ++j) rest.at(j, k) = 0.1 * static_cast<double>(k) - j;
    for (int j = 0; j < 6; ++j) hat.at(j, k) = 0.01 * j;
  }
  dynamics::ElementLaw law{.h = h, .c = {0.7, 1, 1.3, 4e2, 1.5e2, 1.2e2}, .rate = 0.3};
  kernel.strains(count, frames.rows(), said.psi.rows());
  kernel.prepare(count, law, rest.rows(), said.psi.rows(), hat.rows(), said.elastic.rows());
  std::vector<double> energies(elements + 8);
  kernel.wrenches(count, law, said.psi.rows(), said.elastic.rows(), said.wrench.rows(), energies.data());
  BlockTridiagonal system;
  system.resize(nodes.size());
  kernel.derivatives(count, law, said.psi.rows(), said.elastic.rows(), said.wrench.rows(), geometric,
                     system.diagonalBlocks(), system.upperBlocks());
  for (std::size_t k = 0; k < elements; ++k) {
    for (Table* table : {&said.psi, &said.elastic, &said.wrench})
      for (int j = 0; j < (table == &said.elastic ? 8 : 6); ++j) said.all.push_back(table->at(j, k));
    said.all.push_back(energies[k]);
  }
  const std::size_t block_values = nodes.size() * dynamics::kBlock;
  said.all.insert(said.all.end(), system.diagonalBlocks(), system.diagonalBlocks() + block_values);
  said.all.insert(said.all.end(), system.upperBlocks(), system.upperBlocks() + block_values);
  for (std::size_t k = 0; k < nodes.size(); ++k) system.diagonal(k).diagonal().array() += 10 / (h * h);
  said.all.push_back(kernel.solve(static_cast<int>(nodes.size()), system.diagonalBlocks(),
                                  system.upperBlocks(), system.solution.front().data()));
  for (const Vector6& x : system.solution) said.all.insert(said.all.end(), x.data(), x.data() + 6);
  return said;
}

TEST(DynamicsKernels, AllInstructionSetsGiveTheSameBits) {
  Random random(11);
  for (const int elements : {1, 2, 7, 8, 9, 40, 43})
    for (const double bend : {0.0, 1e-9, 0.3, 3.0})
      for (const bool geometric : {false, true}) {
        const std::vector<Node> rod = randomRod(random, elements, 0.025, bend);
        const Said first = whatIsSaid(dynamics::kernelFor(InstructionSet::portable), rod, 0.025, geometric);
        for (const InstructionSet set : instructionSets()) {
          const Said other = whatIsSaid(dynamics::kernelFor(set), rod, 0.025, geometric);
          ASSERT_EQ(first.all.size(), other.all.size());
          EXPECT_EQ(std::memcmp(first.all.data(), other.all.data(), first.all.size() * sizeof(double)), 0)
              << name(set) << ", " << elements << " elements";
        }
      }
}

TEST(DynamicsKernels, StrainsAreTheLogarithmsOfTheRelativeFrames) {
  Random random(12);
  for (const double bend : {0.0, 1e-12, 1e-6, 1e-3, 0.1, 0.5, 0.9, 1.1, 3.0}) {
    const std::vector<Node> rod = randomRod(random, 33, 0.1, bend);
    const Said said = whatIsSaid(dynamics::kernel(), rod, 0.1, false);
    for (std::size_t k = 0; k < 33; ++k) {
      const Vector6 expected = logSE3(rod[k].pose.inverse() * rod[k + 1].pose);
      for (int j = 0; j < 6; ++j)
        EXPECT_NEAR(said.psi.at(j, k), expected[j], 5e-15 * (1 + expected.norm())) << bend;
    }
  }
}

}  // namespace
}  // namespace tendril
