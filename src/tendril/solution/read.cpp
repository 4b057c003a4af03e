#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <set>

#include "tendril/solution.h"

namespace tendril {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

constexpr std::array kStatuses = {PlanStatus::solved, PlanStatus::time_limit, PlanStatus::iteration_limit,
                                  PlanStatus::cancelled, PlanStatus::simulated};

// The types a quantity has: readAs(json, out, elements of the rod) is false where the json is of another
// type.

bool readAs(const Json& json, double& out, std::size_t) {
  if (json.is_number()) out = json.get<double>();
  return json.is_number();
}
bool readAs(const Json& json, std::int64_t& out, std::size_t) {
  if (!json.is_number_integer() || json < 0 || json > std::numeric_limits<std::int64_t>::max()) return false;
  out = json.get<std::int64_t>();
  return true;
}
bool readAs(const Json& json, Vector3& out, std::size_t n) {
  return json.is_array() && json.size() == 3 && readAs(json[0], out[0], n) && readAs(json[1], out[1], n) &&
         readAs(json[2], out[2], n);
}
bool readAs(const Json& json, std::string& out, std::size_t) {
  if (json.is_string()) out = json.get<std::string>();
  return json.is_string();
}
/// One of several values by its name.
template <class Value, std::size_t kCount>
bool readName(const Json& json, const std::array<Value, kCount>& values, Value& out) {
  const auto found =
      std::find_if(values.begin(), values.end(), [&](Value value) { return json == name(value); });
  if (found != values.end()) out = *found;
  return found != values.end();
}
bool readAs(const Json& json, Limit& out, std::size_t) { return readName(json, kLimits, out); }
bool readAs(const Json& json, End& out, std::size_t) { return readName(json, kBothEnds, out); }
bool readAs(const Json& json, FaceContact& out, std::size_t n) {
  if (!json.is_object() || json.size() != 5) return false;
  for (const char* key : {"s_m", "position_m", "force_n", "mesh", "face"})
    if (!json.contains(key)) return false;
  return readAs(json["s_m"], out.s, n) && readAs(json["position_m"], out.position, n) &&
         readAs(json["force_n"], out.force, n) && readAs(json["mesh"], out.mesh, n) &&
         readAs(json["face"], out.face, n);
}
template <class Value>
bool readAs(const Json& json, std::optional<Value>& out, std::size_t n) {
  return json.is_null() || readAs(json, out.emplace(), n);
}
template <class Value>
bool readAs(const Json& json, std::array<Value, 2>& out, std::size_t n) {
  return json.is_array() && json.size() == 2 && readAs(json[0], out[0], n) && readAs(json[1], out[1], n);
}
bool readAs(const Json& json, std::vector<Vector3>& out, std::size_t n) {
  if (!json.is_array() || json.size() != n) return false;
  out.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    if (!readAs(json[i], out[i], n)) return false;
  return true;
}
template <class Contact>
bool readAs(const Json& json, std::vector<Contact>& out, std::size_t n) {
  if (!json.is_array()) return false;
  for (const Json& contact : json) {
    if (!contact.is_object() || contact.size() != 3) return false;
    for (const char* key : {"s_m", "position_m", "force_n"})
      if (!contact.contains(key)) return false;
    Contact& c = out.emplace_back();
    if (!readAs(contact["s_m"], c.s, n) || !readAs(contact["position_m"], c.position, n) ||
        !readAs(contact["force_n"], c.force, n))
      return false;
  }
  return true;
}

std::string kindOf(double, std::size_t) { return "a number"; }
std::string kindOf(std::int64_t, std::size_t) { return "a whole number >= 0"; }
std::string kindOf(const std::optional<double>&, std::size_t) { return "a number or null"; }
std::string kindOf(const std::optional<Vector3>&, std::size_t) { return "a list of three numbers or null"; }
std::string kindOf(const std::optional<Limit>&, std::size_t) {
  std::vector<std::string> names;
  for (const Limit limit : kLimits) names.emplace_back(name(limit));
  return fmt::format("one of {}, or null", fmt::join(names, ", "));
}
std::string kindOf(const std::optional<End>&, std::size_t) { return "first, last or null"; }
std::string kindOf(const std::optional<FaceContact>&, std::size_t) {
  return "null or an object with s_m (a number), position_m and force_n (three numbers each), mesh (text) "
         "and face (a whole number >= 0)";
}
std::string kindOf(const std::array<double, 2>&, std::size_t) { return "a list of two numbers"; }
std::string kindOf(const std::array<Vector3, 2>&, std::size_t) {
  return "a list of two lists of three numbers";
}
std::string kindOf(const std::vector<Vector3>&, std::size_t elements) {
  return fmt::format("a list of {} lists of three numbers, one per element of the rod", elements);
}
std::string kindOf(const std::vector<ContactForce>&, std::size_t) {
  return "a list of objects with s_m (a number), position_m and force_n (three numbers each)";
}
std::string kindOf(const std::vector<SelfContactForce>&, std::size_t) {
  return "a list of objects with s_m (two numbers), position_m and force_n (three numbers each)";
}

/// Reads the parts of one solution file; every message begins with its name.
class SolutionReader {
 public:
  explicit SolutionReader(fs::path file) : file_(std::move(file)) {}

  Solution read(const std::optional<fs::path>& scenario_override) const {
    const Json root = parse();
    if (root.is_object() && root.contains("tendril_scenario"))
      fail("this is a scenario; a solution is needed here.");
    if (!root.is_object() || !root.contains("tendril_solution"))
      fail("this is not a solution: it does not begin with \"tendril_solution\": 1.");
    if (root["tendril_solution"] != 1)
      fail(fmt::format("tendril_solution is {}; this program reads version 1.",
                       root["tendril_solution"].dump()));
    std::vector<std::string> keys = {"tendril_solution", "status",    "scenario", "run",
                                     "controls",         "trajectory"};
    for (const char* key : {"shortfall", "quantities"})
      if (root.contains(key)) keys.emplace_back(key);
    checkKeys(root, "", keys);

    Solution solution;
    solution.status = readStatus(root["status"]);
    readScenarioSection(root["scenario"], scenario_override, solution);
    solution.run = readRun(root["run"]);
    if (root.contains("shortfall")) readShortfall(root["shortfall"], solution.shortfall.emplace());
    solution.controls = controlsFromJson(root["controls"], where("controls"));
    solution.trajectory =
        readTrajectory(root["trajectory"], static_cast<std::size_t>(solution.scenario.rod.elements) + 1);
    if (root.contains("quantities")) readQuantities(root["quantities"], solution);
    return solution;
  }

 private:
  [[noreturn]] void fail(std::string_view what) const {
    throw InputError(fmt::format("{}: {}", file_.string(), what));
  }
  [[noreturn]] void refuse(const std::string& path, const Json& value, std::string_view rule) const {
    const std::string text = value.is_array()    ? "a list"
                             : value.is_object() ? "a mapping"
                                                 : value.dump().substr(0, 60);
    fail(fmt::format("{} is {}; {}", path, text, rule));
  }
  [[nodiscard]] std::string where(std::string_view path) const {
    return fmt::format("{}: {}", file_.string(), path);
  }

  /// The whole file as JSON. nlohmann keeps the last of two equal keys; here they are an error.
  [[nodiscard]] Json parse() const {
    std::vector<std::set<std::string>> open;  // the keys of each object being read
    const auto check = [&](int, Json::parse_event_t event, Json& parsed) {
      if (event == Json::parse_event_t::object_start) open.emplace_back();
      if (event == Json::parse_event_t::object_end) open.pop_back();
      if (event == Json::parse_event_t::key && !open.back().insert(parsed.get<std::string>()).second)
        fail(fmt::format("the key {} appears twice in one object; keep one.", parsed.dump()));
      return true;
    };
    try {
      return Json::parse(readFile(file_), check);
    } catch (const Json::exception& e) {
      std::string_view reason =
          e.what();  // "[json.exception.parse_error.101] parse error at line 1, column 5: ..."
      reason.remove_prefix(std::min(reason.size(), reason.find("] ") + 2));
      fail(fmt::format("this is not JSON: {}.", reason));
    }
  }

  /// Throws unless `object` has exactly the keys `keys`.
  void checkKeys(const Json& object, const std::string& path, const std::vector<std::string>& keys) const {
    if (!object.is_object())
      refuse(path, object, fmt::format("it must be an object with the keys {}.", fmt::join(keys, ", ")));
    for (const auto& [key, value] : object.items()) {
      if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
      const std::string near = nearestWord(key, keys);
      fail(fmt::format("unknown key \"{}\"{}; {}", key, path.empty() ? "" : " in " + path,
                       near.empty() ? fmt::format("the keys are {}.", fmt::join(keys, ", "))
                                    : fmt::format("did you mean \"{}\"?", near)));
    }
    for (const std::string& key : keys)
      if (!object.contains(key)) fail(fmt::format("{}{} is missing.", path.empty() ? "" : path + ".", key));
  }

  [[nodiscard]] const std::string& text(const Json& value, const std::string& path) const {
    if (!value.is_string()) refuse(path, value, "it must be text.");
    return value.get_ref<const std::string&>();
  }
  [[nodiscard]] double number(const Json& value, const std::string& path) const {
    if (!value.is_number()) refuse(path, value, "it must be a number.");
    return value.get<double>();
  }
  [[nodiscard]] std::int64_t count(const Json& value, const std::string& path) const {
    if (!value.is_number_integer() || value < 0 || value > std::numeric_limits<std::int64_t>::max())
      refuse(path, value, "it must be a whole number >= 0.");
    return value.get<std::int64_t>();
  }
  [[nodiscard]] const std::string& hash(const Json& value, const std::string& path) const {
    const std::string& digits = text(value, path);
    if (digits.size() != 64 || digits.find_first_not_of("0123456789abcdef") != std::string::npos)
      refuse(path, value, "it must be a SHA-256 in 64 lower-case hexadecimal digits.");
    return digits;
  }
  [[nodiscard]] const Json::array_t& list(const Json& value, const std::string& path) const {
    if (!value.is_array()) refuse(path, value, "it must be a list.");
    return value.get_ref<const Json::array_t&>();
  }

  [[nodiscard]] PlanStatus readStatus(const Json& value) const {
    std::vector<std::string> names;
    for (const PlanStatus status : kStatuses) {
      names.emplace_back(name(status));
      if (value == names.back()) return status;
    }
    refuse("status", value, fmt::format("it must be one of {}.", fmt::join(names, ", ")));
  }

  void readScenarioSection(const Json& value, const std::optional<fs::path>& scenario_override,
                           Solution& solution) const {
    if (!value.is_object()) refuse("scenario", value, "it must be a scenario.");
    for (const char* key : {"file", "sha256", "mesh_sha256"})
      if (!value.contains(key)) fail(fmt::format("scenario.{} is missing.", key));
    Json scenario = value;
    for (const char* key : {"file", "sha256", "mesh_sha256"}) scenario.erase(key);
    solution.scenario = scenarioFromJson(scenario, where("scenario"));
    solution.scenario.sha256 = hash(value["sha256"], "scenario.sha256");
    const Json::array_t& hashes = list(value["mesh_sha256"], "scenario.mesh_sha256");
    for (std::size_t i = 0; i < hashes.size(); ++i)
      solution.mesh_sha256.push_back(hash(hashes[i], fmt::format("scenario.mesh_sha256[{}]", i)));
    if (hashes.size() != solution.scenario.environment.meshes.size())
      fail(fmt::format("scenario.mesh_sha256 has {} values for {} meshes.", hashes.size(),
                       solution.scenario.environment.meshes.size()));

    if (scenario_override && !fs::is_regular_file(*scenario_override))
      throw InputError(fmt::format("{}: no such file; name the scenario of {}.", scenario_override->string(),
                                   file_.string()));
    const fs::path recorded = text(value["file"], "scenario.file");
    const fs::path found =
        fs::absolute(scenario_override ? *scenario_override : fs::absolute(file_).parent_path() / recorded);
    std::error_code error;
    const fs::path folder = fs::weakly_canonical(found.parent_path(), error);
    solution.scenario.file = error ? found.lexically_normal() : folder / found.filename();
  }

  [[nodiscard]] Provenance readRun(const Json& value) const {
    checkKeys(value, "run",
              {"version", "seed", "threads", "planner", "wall_time_s", "cpu_time_s", "iterations", "states",
               "steps", "simulated_time_s", "host"});
    Provenance run;
    run.version = text(value["version"], "run.version");
    if (!value["seed"].is_number_unsigned())
      refuse("run.seed", value["seed"], "it must be a whole number >= 0.");
    run.seed = value["seed"].get<std::uint64_t>();
    const std::int64_t threads = count(value["threads"], "run.threads");
    if (threads < 1 || threads > 1'000'000) refuse("run.threads", value["threads"], "it must be at least 1.");
    run.threads = static_cast<int>(threads);
    run.planner = value["planner"];
    if (!run.planner.is_object()) refuse("run.planner", run.planner, "it must be an object.");
    run.wall_time = number(value["wall_time_s"], "run.wall_time_s");
    run.cpu_time = number(value["cpu_time_s"], "run.cpu_time_s");
    run.iterations = count(value["iterations"], "run.iterations");
    run.states = count(value["states"], "run.states");
    run.steps = count(value["steps"], "run.steps");
    run.simulated_time = number(value["simulated_time_s"], "run.simulated_time_s");
    run.host = text(value["host"], "run.host");
    return run;
  }

  [[nodiscard]] std::array<bool, 2> readHeld(const Json& value, std::size_t k) const {
    const Json::array_t& ends = list(value, fmt::format("trajectory.held[{}]", k));
    std::array<bool, 2> held = {false, false};
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const bool is_first = ends[i] == "first", is_last = ends[i] == "last";
      if ((!is_first && !is_last) || held[is_first ? 0 : 1])
        refuse(fmt::format("trajectory.held[{}][{}]", k, i), ends[i],
               "it must be first or last, each at most once.");
      held[is_first ? 0 : 1] = true;
    }
    return held;
  }

  [[nodiscard]] RodShape readShape(const Json& value, std::size_t k, std::size_t nodes) const {
    const auto path = [&] { return fmt::format("trajectory.nodes[{}]", k); };
    const Json::array_t& rows = list(value, path());
    if (rows.size() != nodes)
      fail(fmt::format("{} has {} nodes; the rod has {} (rod.elements + 1).", path(), rows.size(), nodes));
    RodShape shape(nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
      if (!rows[i].is_array() || rows[i].size() != 7)
        refuse(fmt::format("{}[{}]", path(), i), rows[i],
               "it must be a list of seven numbers, x y z qw qx qy qz.");
      std::array<double, 7> x{};
      for (std::size_t j = 0; j < 7; ++j) {
        if (!rows[i][j].is_number())
          refuse(fmt::format("{}[{}][{}]", path(), i, j), rows[i][j], "it must be a number.");
        x[j] = rows[i][j].get<double>();
      }
      shape[i] = {Quaternion(x[3], x[4], x[5], x[6]), Vector3(x[0], x[1], x[2])};
    }
    return shape;
  }

  [[nodiscard]] Trajectory readTrajectory(const Json& value, std::size_t nodes) const {
    checkKeys(value, "trajectory", {"time_s", "held", "nodes"});
    const Json::array_t& times = list(value["time_s"], "trajectory.time_s");
    const Json::array_t& held = list(value["held"], "trajectory.held");
    const Json::array_t& states = list(value["nodes"], "trajectory.nodes");
    if (states.empty()) fail("trajectory.nodes has no states; there must be at least the start.");
    if (times.size() != states.size() || held.size() != states.size())
      fail(fmt::format("trajectory has {} times, {} held and {} nodes; there must be one of each per state.",
                       times.size(), held.size(), states.size()));
    Trajectory trajectory;
    for (std::size_t k = 0; k < states.size(); ++k) {
      trajectory.time_s.push_back(number(times[k], fmt::format("trajectory.time_s[{}]", k)));
      trajectory.held.push_back(readHeld(held[k], k));
      trajectory.shapes.push_back(readShape(states[k], k, nodes));
    }
    return trajectory;
  }

  void readShortfall(const Json& value, Shortfall& out) const {
    std::vector<std::string> keys;
    visitShortfall([&](const char* key, auto) { keys.emplace_back(key); });
    checkKeys(value, "shortfall", keys);
    visitShortfall([&](const char* key, auto member) {
      if (!readAs(value[key], out.*member, 0))
        refuse(fmt::format("shortfall.{}", key), value[key],
               fmt::format("it must be {}.", kindOf(out.*member, 0)));
    });
  }

  void readQuantities(const Json& value, Solution& solution) const {
    std::vector<std::string> keys;
    visitQuantities([&](const char* key, auto) { keys.emplace_back(key); });
    checkKeys(value, "quantities", keys);
    const auto elements = static_cast<std::size_t>(solution.scenario.rod.elements);
    std::vector<Quantities>& out = solution.quantities;
    out.resize(list(value["time_s"], "quantities.time_s").size());
    visitQuantities([&](const char* key, auto member) {
      const std::string path = fmt::format("quantities.{}", key);
      const Json::array_t& column = list(value[key], path);
      if (column.size() != out.size())
        fail(fmt::format("{} has {} values, quantities.time_s {}; there must be one of each per step.", path,
                         column.size(), out.size()));
      for (std::size_t k = 0; k < out.size(); ++k)
        if (!readAs(column[k], out[k].*member, elements))
          refuse(fmt::format("{}[{}]", path, k), column[k],
                 fmt::format("it must be {}.", kindOf(out[k].*member, elements)));
    });
    for (std::size_t k = 0; k < out.size(); ++k)
      if (out[k].state >= std::ssize(solution.trajectory.shapes))
        refuse(fmt::format("quantities.state[{}]", k), out[k].state,
               fmt::format("the trajectory has {} states.", solution.trajectory.shapes.size()));
  }

  fs::path file_;
};

}  // namespace

Solution readSolution(const fs::path& file, const std::optional<fs::path>& scenario_override) {
  return SolutionReader(file).read(scenario_override);
}

std::vector<std::string> meshHashes(const Scenario& scenario) {
  std::vector<std::string> hashes;
  for (std::size_t i = 0; i < scenario.environment.meshes.size(); ++i) {
    const MeshReference& mesh = scenario.environment.meshes[i];
    try {
      hashes.push_back(sha256Hex(readFile(scenario.meshPath(mesh))));
    } catch (const InputError& e) {
      throw InputError(fmt::format("{}: environment.meshes[{}].file is \"{}\"; {}", scenario.file.string(), i,
                                   mesh.file, e.what()));
    }
  }
  return hashes;
}

}  // namespace tendril
