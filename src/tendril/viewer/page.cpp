#include <cassert>
#include <cmath>

#include "base64.h"
#include "contacts.h"
#include "page_template.h"
#include "tendril/viewer.h"

namespace tendril {
namespace {

using nlohmann::json;
using viewer::base64;

/// The element of the page that takes the data; viewer/vite.config.js sees to it that it is there exactly
/// once.
constexpr std::string_view kDataOpen = R"(<script type="application/json" id="tendril-data">)";
constexpr std::string_view kDataClose = "</script>";

json vectorToJson(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// positions: float32, states x nodes x 3 [m]; rotations: int16, states x nodes x 4, x y z w of the unit
/// quaternion times 32767 (5e-5 rad, for the stripe along the rod only).
json shapesToJson(std::span<const RodShape> shapes) {
  const std::size_t nodes = shapes.empty() ? 0 : shapes.front().size();
  std::vector<float> positions;
  std::vector<std::int16_t> rotations;
  positions.reserve(shapes.size() * nodes * 3);
  rotations.reserve(shapes.size() * nodes * 4);
  for (const RodShape& shape : shapes) {
    assert(shape.size() == nodes);
    for (const Pose& node : shape) {
      for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(node.position[axis]));
      const Eigen::Vector4d xyzw = node.rotation.normalized().coeffs();
      for (int k = 0; k < 4; ++k)
        rotations.push_back(static_cast<std::int16_t>(std::lround(xyzw[k] * 32767)));
    }
  }
  return {{"states", shapes.size()},
          {"nodes", nodes},
          {"positions", base64(positions)},
          {"rotations", base64(rotations)}};
}

json meshesToJson(const Scenario& scenario, std::span<const TriangleMesh> meshes) {
  json out = json::array();
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    std::vector<float> vertices;
    std::vector<std::uint32_t> faces;
    vertices.reserve(meshes[i].vertices.size() * 3);
    faces.reserve(meshes[i].faces.size() * 3);
    for (const Vector3& v : meshes[i].vertices)
      for (int axis = 0; axis < 3; ++axis) vertices.push_back(static_cast<float>(v[axis]));
    for (const std::array<int, 3>& face : meshes[i].faces)
      for (const int v : face) faces.push_back(static_cast<std::uint32_t>(v));
    const auto& names = scenario.environment.meshes;
    out.push_back({{"name", i < names.size() ? names[i].file : ""},
                   {"vertices", base64(vertices)},
                   {"faces", base64(faces)}});
  }
  return out;
}

json controlsToJson(const std::vector<Control>& controls) {
  json out = json::array();
  for (const Control& control : controls) {
    json held = json::array();
    for (const End end : kBothEnds)
      if (control.isHeld(end)) held.push_back(name(end));
    json entry = {
        {"start_s", control.start_s}, {"end_s", control.end_s}, {"held", held}, {"moving", nullptr}};
    if (control.moving) {
      entry["moving"] = name(*control.moving);
      entry["target"] = toJson(control.target);
    }
    out.push_back(std::move(entry));
  }
  return out;
}

/// The goal's ghost and where its grippers are.
json goalToJson(const Scenario& scenario, const RodShape& goal_shape) {
  json goal = {{"shape", nullptr}, {"grippers", json::array()}};
  if (!goal_shape.empty()) {
    goal["shape"] = shapesToJson(std::span(&goal_shape, 1));
    goal["grippers"] = {toJson(goal_shape.front()), toJson(goal_shape.back())};
  }
  if (scenario.goal)
    if (const auto* ends = std::get_if<GripperPoses>(&scenario.goal->placement))
      goal["grippers"] = {toJson(ends->first), toJson(ends->last)};
  return goal;
}

json trajectoryToJson(const Trajectory& trajectory, const std::vector<float>& gaps) {
  std::vector<std::uint8_t> held;  // bit 0: first, bit 1: last
  for (const std::array<bool, 2>& ends : trajectory.held)
    held.push_back(static_cast<std::uint8_t>(int{ends[0]} + 2 * int{ends[1]}));
  json out = shapesToJson(trajectory.shapes);
  out["time_s"] = base64(trajectory.time_s);
  out["held"] = base64(held);
  out["gap_m"] = base64(gaps);
  return out;
}

json pageData(const Solution& solution, std::span<const TriangleMesh> meshes, const Obstacles& obstacles,
              const RodShape& goal_shape) {
  const Scenario& scenario = solution.scenario;
  const Provenance& run = solution.run;
  const viewer::Contacts contacts = viewer::findContacts(solution, obstacles);
  return {
      {"format", 1},
      {"name", scenario.name},
      {"summary", scenario.summary},
      {"status", name(solution.status)},
      {"rod", {{"length_m", scenario.rod.length}, {"radius_m", scenario.rod.radius}}},
      {"workspace",
       {{"min", vectorToJson(scenario.environment.workspace.min)},
        {"max", vectorToJson(scenario.environment.workspace.max)}}},
      {"gravity", vectorToJson(scenario.environment.gravity)},
      {"run",
       {{"version", run.version},
        {"seed", std::to_string(run.seed)},  // may be larger than what a JavaScript number holds
        {"threads", run.threads},
        {"planner", run.planner.is_object() ? run.planner.value("name", "") : ""},
        {"wall_time_s", run.wall_time},
        {"cpu_time_s", run.cpu_time},
        {"iterations", run.iterations},
        {"states", run.states},
        {"steps", run.steps},
        {"simulated_time_s", run.simulated_time}}},
      {"meshes", meshesToJson(scenario, meshes)},
      {"trajectory", trajectoryToJson(solution.trajectory, contacts.gaps)},
      {"goal", goalToJson(scenario, goal_shape)},
      {"controls", controlsToJson(solution.controls)},
      {"contacts",
       {{"stride", contacts.stride},
        {"reach_m", contacts.reach},
        {"offsets", base64(contacts.offsets)},
        {"points", base64(contacts.points)}}},
  };
}

/// JSON that cannot end the element it stands in: "<" occurs in strings only, where it may be written as an
/// escape. Bytes that are not UTF-8 become U+FFFD.
std::string jsonInHtml(const json& data) {
  const std::string text = data.dump(-1, ' ', false, json::error_handler_t::replace);
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (c == '<')
      out += "\\u003c";
    else
      out.push_back(c);
  }
  return out;
}

}  // namespace

void writePage(const Solution& solution, std::span<const TriangleMesh> meshes, const Obstacles& obstacles,
               const RodShape& goal_shape, const std::filesystem::path& file) {
  const std::string_view page = viewer::pageTemplate();
  const std::size_t element = page.find(std::string(kDataOpen) + std::string(kDataClose));
  assert(element != std::string_view::npos);
  const std::size_t place = element + kDataOpen.size();
  std::string out(page.substr(0, place));
  out += jsonInHtml(pageData(solution, meshes, obstacles, goal_shape));
  out += page.substr(place);
  writeFileAtomically(file, out);
}

}  // namespace tendril
