/// app/common.h: what several commands need: loading, the second half of writing a solution, Ctrl-C,
/// printing.
#pragma once

#include <atomic>
#include <chrono>
#include <string>

#include "tendril/geometry.h"
#include "tendril/solution.h"
#include "tendril/statics.h"
#include "tendril/verification.h"

namespace tendril::app {

/// When the process started, and the wall time since then [s].
[[nodiscard]] std::chrono::steady_clock::time_point processStart();
[[nodiscard]] double secondsSinceStart();

/// The scenario's meshes, loaded and indexed.
struct World {
  std::vector<TriangleMesh> meshes;
  Obstacles obstacles;
};
[[nodiscard]] World loadWorld(const Scenario& scenario);
/// The same for a solution. Throws InputError if a mesh is not the one the solution was made with.
[[nodiscard]] World loadWorld(const Solution& solution);

/// -o DIR, or out/<the scenario's name> if `given` is empty. Throws InputError if files could not be written
/// there; makes nothing.
[[nodiscard]] std::filesystem::path outputFolder(const std::string& given, const Scenario& scenario);
/// Throws InputError if a file could not be written into `folder` (made or not yet).
void requireWritable(const std::filesystem::path& folder);

/// Simulates a solution's controls once more and measures every step of the motion.
void measureMotion(Solution& solution, const World& world);

/// Where a solution and its page went.
struct Written {
  std::filesystem::path solution, page;
};
/// Fills in version, host and mesh hashes, which the library leaves to its caller.
void stamp(Solution& solution);
/// Writes solution.json and view.html into `folder`.
Written writeSolutionAndPage(const Solution& solution, const World& world,
                             const std::filesystem::path& folder);
/// Writes the page, with the goal's shape as a ghost where the scenario has a goal that can be reached at
/// all.
void writePageOf(const Solution& solution, const World& world, const std::filesystem::path& file);

/// Set by the first Ctrl-C (or SIGTERM); the second ends the process at once. Installs the handler on the
/// first call.
[[nodiscard]] const std::atomic<bool>& cancelFlag();

/// Prints one JSON object on standard output.
void printJson(const nlohmann::json& object);
/// One equilibrium as an element of "samples".
[[nodiscard]] nlohmann::json toJson(const Equilibrium& equilibrium, bool with_nodes);
/// One equilibrium as one line of text.
[[nodiscard]] std::string describe(const Equilibrium& equilibrium);
/// Adds "extremes" and "quantities" to a summary if the solution has quantities.
void addQuantities(nlohmann::json& summary, const Solution& solution);
/// Prints one line per extreme, nothing if the solution has no quantities.
void printExtremes(const Solution& solution);
/// {"valid", "smallest_clearance_m", "checks"}.
[[nodiscard]] nlohmann::json toJson(const VerificationReport& report);

}  // namespace tendril::app
