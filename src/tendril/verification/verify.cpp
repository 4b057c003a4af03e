#include <fmt/format.h>

#include "tendril/geometry.h"
#include "tendril/verification.h"
#include "tendril/verification/clearance.h"
#include "tendril/verification/ends.h"
#include "tendril/verification/face_tree.h"
#include "tendril/verification/trajectory_checks.h"

namespace tendril {
namespace {

using namespace verification;

/// Throws InputError if a mesh is not the one the solution was made with.
void checkMeshHashes(const Solution& solution) {
  const auto& meshes = solution.scenario.environment.meshes;
  const auto& recorded = solution.mesh_sha256;
  if (recorded.empty()) return;
  if (recorded.size() != meshes.size())
    throw InputError(
        fmt::format("the solution records the sha256 of {} meshes, but its scenario has {}; plan again",
                    recorded.size(), meshes.size()));
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    if (recorded[m].empty()) continue;
    const auto path = solution.scenario.meshPath(meshes[m]);
    const std::string found = sha256Hex(readFile(path));
    if (found != recorded[m])
      throw InputError(
          fmt::format("{}: the mesh has changed since the solution was made: its sha256 is {}, the solution "
                      "records {}; restore the mesh or plan again",
                      path.string(), found, recorded[m]));
  }
}

FaceTree loadFaces(const Scenario& scenario) {
  std::vector<Face> faces;
  int number = 0;
  for (const MeshReference& reference : scenario.environment.meshes) {
    const TriangleMesh mesh = loadMesh(scenario.meshPath(reference), reference.scale, reference.pose);
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      Face face;
      for (std::size_t c = 0; c < 3; ++c)
        face.corners[c] = mesh.vertices[static_cast<std::size_t>(mesh.faces[f][c])];
      face.normal =
          (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]).stableNormalized();
      face.mesh = number, face.number = static_cast<int>(f);
      faces.push_back(face);
    }
    ++number;
  }
  return FaceTree(std::move(faces));
}

}  // namespace

VerificationReport verify(const Solution& solution) {
  const Scenario& scenario = solution.scenario;
  const Trajectory& trajectory = solution.trajectory;
  checkMeshHashes(solution);
  const FaceTree faces = loadFaces(scenario);
  std::vector<std::string> mesh_names;
  for (const MeshReference& mesh : scenario.environment.meshes) mesh_names.push_back(mesh.file);

  VerificationReport report;
  report.checks.push_back(checkStructure(solution));
  if (!report.checks.back().passed) return report;
  report.checks.push_back(checkTimes(trajectory));
  if (report.checks.back().passed)
    for (const auto check : {checkControls, checkHeld, checkSpeed}) report.checks.push_back(check(solution));
  report.checks.push_back(checkQuaternions(trajectory));
  report.checks.push_back(checkFrames(trajectory));
  report.checks.push_back(checkStretch(trajectory, scenario.rod));
  report.checks.push_back(checkSteps(trajectory, scenario.rod));
  report.checks.push_back(checkWorkspace(trajectory, scenario.environment.workspace));
  const Clearance clearance = checkClearance(trajectory, scenario.rod, faces, mesh_names);
  report.checks.push_back(clearance.check);
  report.smallest_clearance = clearance.smallest;
  if (scenario.rod.self_contact) report.checks.push_back(checkSelfContact(trajectory, scenario.rod).check);
  report.checks.push_back(checkStart(solution, faces));
  // A simulation has no goal to reach, nor has one that was cancelled in a scenario without a goal.
  const bool has_goal = scenario.goal || solution.status == PlanStatus::solved;
  if (solution.status != PlanStatus::simulated && has_goal)
    report.checks.push_back(checkGoal(solution, faces));
  return report;
}

}  // namespace tendril
