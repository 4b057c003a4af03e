#include <sys/stat.h>

#include <cassert>
#include <charconv>
#include <cmath>
#include <optional>

#include "tendril/solution.h"

namespace tendril {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kLineWidth = 110;  // values that fit are written in one line

/// Appends x with 17 significant digits, which give back the same bits; always a JSON number, "-0.0"
/// included.
void appendNumber(std::string& out, double x) {
  assert(std::isfinite(x));
  if (x == 0) {
    out += std::signbit(x) ? "-0.0" : "0";
    return;
  }
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, x, std::chars_format::general, 17).ptr;
  out.append(digits, end);
}

void appendHeld(std::string& out, const std::array<bool, 2>& held) {
  out += held[0] && held[1] ? R"(["first", "last"])"
         : held[0]          ? R"(["first"])"
         : held[1]          ? R"(["last"])"
                            : "[]";
}

void appendShape(std::string& out, const RodShape& shape) {
  out += '[';
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const Vector3& p = shape[i].position;
    const Quaternion& q = shape[i].rotation;
    out += i == 0 ? "[" : ",[";
    for (const double x : {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}) {
      appendNumber(out, x);
      out += ',';
    }
    out.back() = ']';
  }
  out += ']';
}

/// One line per state.
std::string trajectoryText(const Trajectory& trajectory) {
  assert(trajectory.time_s.size() == trajectory.shapes.size() &&
         trajectory.held.size() == trajectory.shapes.size());
  const std::size_t states = trajectory.shapes.size();
  std::string out = "{\n  \"time_s\": [";
  if (states > 0) out.reserve(states * (60 + 150 * trajectory.shapes.front().size()));
  for (std::size_t k = 0; k < states; ++k) {
    if (k > 0) out += ", ";
    appendNumber(out, trajectory.time_s[k]);
  }
  out += "],\n  \"held\": [";
  for (std::size_t k = 0; k < states; ++k) {
    if (k > 0) out += ", ";
    appendHeld(out, trajectory.held[k]);
  }
  out += "],\n  \"nodes\": [";
  for (std::size_t k = 0; k < states; ++k) {
    out += k == 0 ? "\n   " : ",\n   ";
    appendShape(out, trajectory.shapes[k]);
  }
  return out + "\n  ]\n }";
}

Json toJson(std::int64_t x) { return x; }
Json toJson(double x) { return x; }
Json toJson(const Vector3& x) { return {x.x(), x.y(), x.z()}; }
Json toJson(Limit x) { return name(x); }
Json toJson(End x) { return name(x); }
Json toJson(const FaceContact& c) {
  return {{"s_m", c.s},
          {"position_m", toJson(c.position)},
          {"force_n", toJson(c.force)},
          {"mesh", c.mesh},
          {"face", c.face}};
}
template <class Value>
Json toJson(const std::optional<Value>& x) {
  return x ? toJson(*x) : Json(nullptr);
}
Json toJson(const ContactForce& c) {
  return {{"s_m", c.s}, {"position_m", toJson(c.position)}, {"force_n", toJson(c.force)}};
}
Json toJson(const SelfContactForce& c) {
  return {{"s_m", c.s}, {"position_m", toJson(c.position)}, {"force_n", toJson(c.force)}};
}
template <class List>
Json toJson(const List& list) {
  Json out = Json::array();
  for (const auto& element : list) out.push_back(toJson(element));
  return out;
}

/// One line per quantity, or per quantity and step where a step has more than a number.
std::string quantitiesText(std::span<const Quantities> quantities) {
  const Json columns = tendril::toJson(quantities);
  std::string out = "{";
  for (const auto& [key, column] : columns.items()) {
    out += (out.size() > 1 ? ",\n  \"" : "\n  \"") + key + "\": [";
    const bool lines = column.front().is_structured();
    for (const Json& step : column) {
      if (out.back() != '[') out += ',';
      out += (lines ? "\n   " : out.back() == ',' ? " " : "") + step.dump();
    }
    out += lines ? "\n  ]" : "]";
  }
  return out + "\n }";
}

/// JSON in one line, with a blank after every comma and colon.
std::string oneLine(const Json& json) {
  if (!json.is_structured()) return json.dump();
  std::string out;
  for (const auto& [key, value] : json.items()) {
    if (!out.empty()) out += ", ";
    if (json.is_object()) out += Json(key).dump() + ": ";
    out += oneLine(value);
  }
  return json.is_object() ? "{" + out + "}" : "[" + out + "]";
}

/// JSON for people: what fits stands in one line, the rest is indented by one blank per level.
std::string pretty(const Json& json, std::size_t indent) {
  std::string line = oneLine(json);
  if (!json.is_structured() || indent + line.size() < kLineWidth) return line;
  std::string out;
  for (const auto& [key, value] : json.items()) {
    out += (out.empty() ? "\n" : ",\n") + std::string(indent + 1, ' ');
    if (json.is_object()) out += Json(key).dump() + ": ";
    out += pretty(value, indent + 1);
  }
  out += "\n" + std::string(indent, ' ');
  return json.is_object() ? "{" + out + "}" : "[" + out + "]";
}

/// The file system that holds `path`, or would if it were made.
std::optional<dev_t> fileSystem(fs::path path) {
  struct stat info {};
  while (::stat(path.c_str(), &info) != 0) {
    if (!path.has_relative_path()) return {};
    path = path.parent_path();
  }
  return info.st_dev;
}

/// `file` as seen from `folder`: relative, or absolute if they lie in different file systems.
std::string fileSeenFrom(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path from = fs::weakly_canonical(fs::absolute(folder), error);
  const fs::path target = fs::weakly_canonical(fs::absolute(file).parent_path(), error) / file.filename();
  if (error || fileSystem(from) != fileSystem(target.parent_path())) return fs::absolute(file).string();
  return target.lexically_relative(from).string();
}

Json scenarioJson(const Solution& solution, const fs::path& folder) {
  Json json = toJson(solution.scenario);
  json["file"] = fileSeenFrom(folder, solution.scenario.file);
  json["sha256"] = solution.scenario.sha256;
  json["mesh_sha256"] = solution.mesh_sha256;
  return json;
}

Json runJson(const Provenance& run) {
  return {{"version", run.version},
          {"seed", run.seed},
          {"threads", run.threads},
          {"planner", run.planner},
          {"wall_time_s", run.wall_time},
          {"cpu_time_s", run.cpu_time},
          {"iterations", run.iterations},
          {"states", run.states},
          {"steps", run.steps},
          {"simulated_time_s", run.simulated_time},
          {"host", run.host}};
}

}  // namespace

const char* name(PlanStatus status) {
  switch (status) {
    case PlanStatus::solved:
      return "solved";
    case PlanStatus::time_limit:
      return "time_limit";
    case PlanStatus::iteration_limit:
      return "iteration_limit";
    case PlanStatus::cancelled:
      return "cancelled";
    case PlanStatus::simulated:
      return "simulated";
  }
  return "";
}

const char* name(Limit limit) {
  switch (limit) {
    case Limit::force:
      return "force";
    case Limit::torque:
      return "torque";
    case Limit::bend:
      return "bend";
    case Limit::clearance:
      return "clearance";
    case Limit::workspace:
      return "workspace";
    case Limit::shape:
      return "shape";
    case Limit::time:
      return "time";
  }
  return "";
}

Json toJson(const Shortfall& shortfall) {
  Json out = Json::object();
  visitShortfall([&](const char* key, auto member) { out[key] = toJson(shortfall.*member); });
  return out;
}

Json toJson(std::span<const Quantities> quantities) {
  Json out = Json::object();
  visitQuantities([&](const char* key, auto member) {
    Json column = Json::array();
    for (const Quantities& q : quantities) column.push_back(toJson(q.*member));
    out[key] = std::move(column);
  });
  return out;
}

Json nodesToJson(const RodShape& shape) {
  Json rows = Json::array();
  for (const Pose& node : shape) {
    const Vector3& p = node.position;
    const Quaternion& q = node.rotation;
    rows.push_back({p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()});
  }
  return rows;
}

void writeSolution(const Solution& solution, const fs::path& file) {
  Json controls = Json::array();
  for (const Control& control : solution.controls) controls.push_back(toJson(control));

  const Json scenario = scenarioJson(solution, fs::absolute(file).parent_path());
  std::string out =
      "{\n \"tendril_solution\": 1,\n \"status\": \"" + std::string(name(solution.status)) + "\"";
  out += ",\n \"scenario\": " + pretty(scenario, 1);
  out += ",\n \"run\": " + pretty(runJson(solution.run), 1);
  if (solution.shortfall) out += ",\n \"shortfall\": " + pretty(toJson(*solution.shortfall), 1);
  out += ",\n \"controls\": " + pretty(controls, 1);
  out += ",\n \"trajectory\": " + trajectoryText(solution.trajectory);
  if (!solution.quantities.empty()) out += ",\n \"quantities\": " + quantitiesText(solution.quantities);
  out += "\n}\n";
  writeFileAtomically(file, out);
}

}  // namespace tendril
