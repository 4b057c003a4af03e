#include "tendril/verification/clearance.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tendril/verification/distance.h"

namespace tendril::verification {
namespace {

std::vector<Face> randomFaces(Random& random, int count, double size) {
  std::vector<Face> faces;
  for (int f = 0; f < count; ++f) {
    const Vector3 centre(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    // every tenth face is large, as in the meshes of machines
    const double reach = f % 10 == 0 ? 10 * size : size;
    Face face;
    for (Vector3& corner : face.corners)
      corner = centre + reach * Vector3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    face.normal = (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]).normalized();
    face.mesh = 0, face.number = f;
    faces.push_back(face);
  }
  return faces;
}

RodShape straightRod(const Vector3& from, const Vector3& to, int elements) {
  RodShape shape;
  const Quaternion rotation = Quaternion::FromTwoVectors(Vector3::UnitX(), to - from);
  for (int i = 0; i <= elements; ++i)
    shape.push_back({rotation, from + static_cast<double>(i) / elements * (to - from)});
  return shape;
}

Trajectory motionOf(std::vector<RodShape> shapes) {
  Trajectory trajectory;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    trajectory.time_s.push_back(0.02 * static_cast<double>(k));
    trajectory.held.push_back({true, false});
  }
  trajectory.shapes = std::move(shapes);
  return trajectory;
}

TEST(VerificationFaceTree, LeavesOutNoFaceThatIsNearerThanTheMargin) {
  Random random(4);
  const FaceTree tree(randomFaces(random, 2000, 0.05));
  std::vector<const Face*> found;
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3 p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const Vector3 q = p + 0.1 * Vector3(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const double margin = random.uniform(0, 0.1);
    Bounds box;
    box.include(p), box.include(q);
    tree.facesNear(box, margin, found);
    std::vector<bool> is_found(2000, false);
    for (const Face* face : found) {
      EXPECT_FALSE(is_found[static_cast<std::size_t>(face->number)]);
      is_found[static_cast<std::size_t>(face->number)] = true;
    }
    for (const Face& face : tree.faces()) {
      const bool near =
          segmentToTriangle(p, q, face.corners[0], face.corners[1], face.corners[2]).distance <= margin;
      EXPECT_TRUE(!near || is_found[static_cast<std::size_t>(face.number)]);
    }
  }
}

TEST(VerificationFaceTree, IsEmptyForNoFaces) {
  const FaceTree tree({});
  std::vector<const Face*> found{nullptr};
  tree.facesNear({Vector3::Zero(), Vector3::Ones()}, 1, found);
  EXPECT_TRUE(found.empty());
}

TEST(VerificationClearance, AgreesWithEverySegmentAgainstEveryFaceAtManyMoments) {
  Random random(5);
  RodProperties rod;
  rod.elements = 8;
  int passed = 0, failed = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const FaceTree tree(randomFaces(random, 60, 0.1));
    std::vector<RodShape> shapes;
    Vector3 base(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    Vector3 along = random.rotation() * Vector3::UnitX();
    for (int k = 0; k < 4; ++k) {
      shapes.push_back(straightRod(base, base + along, rod.elements));
      base += 0.05 * (random.rotation() * Vector3::UnitX());
      along = (along + 0.1 * (random.rotation() * Vector3::UnitX())).normalized();
    }
    const Trajectory trajectory = motionOf(shapes);
    const Clearance clearance = checkClearance(trajectory, rod, tree, {"mesh"});
    double sampled = std::numeric_limits<double>::infinity();
    for (std::size_t k = 1; k < shapes.size(); ++k)
      for (int s = 0; s <= 20; ++s)
        for (std::size_t i = 0; i < 8; ++i) {
          const auto node = [&](std::size_t n) -> Vector3 {
            return shapes[k - 1][n].position + s / 20.0 * (shapes[k][n].position - shapes[k - 1][n].position);
          };
          for (const Face& f : tree.faces())
            sampled = std::min(
                sampled,
                segmentToTriangle(node(i), node(i + 1), f.corners[0], f.corners[1], f.corners[2]).distance);
        }
    if (clearance.check.passed) {
      ++passed;
      EXPECT_GE(sampled - rod.radius, clearance.smallest - 1e-12) << clearance.check.message;
      EXPECT_LE(clearance.smallest, 0.1);
      EXPECT_LE(0.95 * std::min(sampled - rod.radius, 0.1), clearance.smallest + 0.01);
    } else {
      ++failed;
      EXPECT_LT(clearance.smallest, 0);
      EXPECT_LT(sampled, rod.radius + 0.01) << clearance.check.message;
    }
    EXPECT_TRUE(sampled > rod.radius - 1e-6 || !clearance.check.passed);
  }
  EXPECT_GT(passed, 10);
  EXPECT_GT(failed, 10);
}

TEST(VerificationClearance, FarFromEveryMeshTheSmallestClearanceIsATenthOfTheLength) {
  RodProperties rod;
  rod.length = 2;
  const Trajectory trajectory = motionOf({straightRod(Vector3::Zero(), 2 * Vector3::UnitX(), rod.elements)});
  const Clearance clearance = checkClearance(trajectory, rod, FaceTree({}), {});
  EXPECT_TRUE(clearance.check.passed);
  EXPECT_DOUBLE_EQ(clearance.smallest, 0.2);
}

/// A hairpin in the xy plane: two straight legs `spacing` apart joined by a half circle. Frames along the
/// tangent.
RodShape hairpin(double spacing, double leg, int elements) {
  const double r = spacing / 2, turn = std::numbers::pi * r, length = 2 * leg + turn;
  RodShape shape;
  for (int i = 0; i <= elements; ++i) {
    const double s = length * i / elements;
    if (s < leg) {
      shape.push_back({Quaternion::Identity(), {s, -r, 0}});
    } else if (s > leg + turn) {
      shape.push_back(
          {Quaternion(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitZ())), {2 * leg + turn - s, r, 0}});
    } else {
      const double angle = (s - leg) / r;
      shape.push_back({Quaternion(Eigen::AngleAxisd(angle, Vector3::UnitZ())),
                       {leg + r * std::sin(angle), -r * std::cos(angle), 0}});
    }
  }
  return shape;
}

TEST(VerificationSelfContact, AHairpinKeepsApartDownToTwiceTheRadius) {
  RodProperties rod;
  rod.self_contact = true;
  rod.elements = 200;
  for (const double spacing : {0.1, 0.021}) {
    rod.length = 0.8 + std::numbers::pi * spacing / 2;
    EXPECT_TRUE(checkSelfContact(motionOf({hairpin(spacing, 0.4, rod.elements)}), rod).check.passed)
        << spacing;
  }
  rod.length = 0.8 + std::numbers::pi * 0.019 / 2;
  const Clearance clearance = checkSelfContact(motionOf({hairpin(0.019, 0.4, rod.elements)}), rod);
  EXPECT_FALSE(clearance.check.passed);
  EXPECT_NE(clearance.check.message.find("twice the radius is 20 mm"), std::string::npos)
      << clearance.check.message;
}

TEST(VerificationSelfContact, LegsThatPassThroughEachOtherBetweenTwoFreeStatesAreFound) {
  RodProperties rod;
  rod.elements = 40;
  rod.length = 0.8 + std::numbers::pi * 0.1 / 2;
  const RodShape before = hairpin(0.1, 0.4, rod.elements);
  RodShape after = before;  // the two legs change places by moving straight through each other
  for (Pose& node : after) node.position.y() = -node.position.y();
  EXPECT_TRUE(checkSelfContact(motionOf({before, before}), rod).check.passed);
  EXPECT_TRUE(checkSelfContact(motionOf({after}), rod).check.passed);
  EXPECT_FALSE(checkSelfContact(motionOf({before, after}), rod).check.passed);
}

TEST(VerificationSelfContact, NeighboursWithinPiTimesTheRadiusAreNotHeldApart) {
  RodProperties rod;
  rod.elements = 100;                   // h = r: neighbours are always nearer than 2r
  EXPECT_EQ(elementsBetween(rod), 4u);  // 4 h > pi r, 3 h is not
  const Trajectory trajectory = motionOf({straightRod(Vector3::Zero(), Vector3::UnitX(), rod.elements)});
  const Clearance clearance = checkSelfContact(trajectory, rod);
  EXPECT_TRUE(clearance.check.passed) << clearance.check.message;
  EXPECT_LE(clearance.smallest, 0.02);
  EXPECT_GE(clearance.smallest, 0.95 * 0.02 - 1e-9);
}

}  // namespace
}  // namespace tendril::verification
