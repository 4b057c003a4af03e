/// What a scenario gives: its meshes, and the model.
#include "tendril/dynamics.h"

namespace tendril {

std::vector<TriangleMesh> loadMeshes(const Scenario& scenario) {
  std::vector<TriangleMesh> meshes;
  for (const MeshReference& mesh : scenario.environment.meshes)
    meshes.push_back(loadMesh(scenario.meshPath(mesh), mesh.scale, mesh.pose));
  return meshes;
}

RodModel::RodModel(const Scenario& scenario, const Obstacles& obstacles_in)
    : rod(scenario.rod),
      simulation(scenario.simulation),
      grippers(scenario.grippers),
      workspace(scenario.environment.workspace),
      friction(scenario.environment.friction),
      gravity(scenario.environment.gravity),
      newton{scenario.simulation.newton_iterations, scenario.simulation.newton_tolerance},
      obstacles(&obstacles_in) {}

}  // namespace tendril
