/// app/commands.h: one function per command of the program. Each declares the command's options on `app`;
/// when the command is given, it runs and stores its exit status: 0 done, 1 the honest no. Bad input leaves
/// as InputError.
#pragma once

#include <CLI/CLI.hpp>

namespace tendril::app {

void addPlan(CLI::App& app, int& status);
void addVerify(CLI::App& app, int& status);
void addReplay(CLI::App& app, int& status);
void addView(CLI::App& app, int& status);
void addSample(CLI::App& app, int& status);
void addEquilibrium(CLI::App& app, int& status);
void addSimulate(CLI::App& app, int& status);
void addBenchmark(CLI::App& app, int& status);

}  // namespace tendril::app
