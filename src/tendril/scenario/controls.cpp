#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tendril/scenario.h"
#include "tendril/scenario/document.h"

namespace tendril {
namespace {

constexpr const char* kListRule = "it must be a list of controls.";

Control readControl(const Value& value) {
  value.allowKeys({"start_s", "end_s", "moving", "held", "target"});
  Control control;
  control.start_s = value.at("start_s").number();
  control.end_s = value.at("end_s").number();
  for (const Value& item : value.at("held").list("it must be a list of first, last.")) {
    bool& held = control.held[item.choice({"first", "last"})];
    if (held) item.refuse("it stands there twice; keep one.");
    held = true;
  }
  const Value& moving = value.at("moving");
  if (moving.kind() != Value::Kind::nothing)
    control.moving = static_cast<End>(moving.choice({"first", "last"}));
  const Value* target = value.find("target");
  if (control.moving && !target) (void)value.at("target");
  if (target && (control.moving || target->kind() != Value::Kind::nothing)) control.target = target->pose();
  return control;
}

/// Throws unless the control begins at `begin_s`, lasts, and holds what `grippers` allow.
void checkControl(const Value& value, const Control& control, double begin_s, const GripperLimits& grippers) {
  if (control.start_s != begin_s)
    value.at("start_s").refuse(fmt::format(
        "it must be {}, {}.", begin_s, begin_s == 0 ? "the beginning" : "where the control before it ends"));
  if (control.end_s <= control.start_s) value.at("end_s").refuse("a control must end after it starts.");
  const Value& held = value.at("held");
  if (!control.held[0] && !control.held[1])
    held.fail(fmt::format("{} has no values; at least one end must be held.", held.path()));
  const Grasp grasp = control.held[0] && control.held[1] ? Grasp::both
                      : control.held[0]                  ? Grasp::first
                                                         : Grasp::last;
  if (!grippers.allows(grasp))
    held.fail(fmt::format("{} means the grasp \"{}\", which the scenario's grippers.grasps do not allow.",
                          held.path(), name(grasp)));
  if (control.moving && !control.isHeld(*control.moving))
    value.at("moving").refuse("an end that moves must be held.");
}

}  // namespace

std::vector<Control> readControls(const std::filesystem::path& file, const GripperLimits& grippers) {
  const Value root = Value::fromText(readFile(file), file.string());
  root.allowKeys({"controls"});
  std::vector<Control> controls;
  double begin_s = 0;
  for (const Value& value : root.at("controls").list(kListRule)) {
    controls.push_back(readControl(value));
    checkControl(value, controls.back(), begin_s, grippers);
    begin_s = controls.back().end_s;
  }
  if (controls.empty()) root.at("controls").fail("controls has no values; give at least one control.");
  return controls;
}

std::vector<Control> controlsFromJson(const nlohmann::json& list, const std::string& where) {
  const Value root = Value::fromJson(list, where);
  std::vector<Control> controls;
  for (const Value& value : root.list(kListRule)) controls.push_back(readControl(value));
  return controls;
}

}  // namespace tendril
