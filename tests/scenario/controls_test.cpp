#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "example.h"

namespace tendril {
namespace {

const std::string kControls = R"({"controls": [
 {"start_s": 0.0, "end_s": 1.2, "moving": "first", "held": ["first", "last"],
  "target": {"position_m": [1, 2, 3], "orientation_wxyz": [0, 0, 1, 0]}},
 {"start_s": 1.2, "end_s": 1.5, "moving": null, "held": ["first"]}
]})";

class Controls : public testing::Test {
 protected:
  std::vector<Control> read(const std::string& text) {
    std::ofstream(file_) << text;
    return readControls(file_, limits_);
  }
  /// The message for the text with `from` replaced by `to`, without the file's name in front.
  std::string messageFor(const std::string& from, const std::string& to) {
    try {
      (void)read(test::changed(from, to, kControls));
      return "";
    } catch (const InputError& e) {
      return std::string(e.what()).substr(file_.string().size());
    }
  }
  void TearDown() override { std::filesystem::remove(file_); }

  std::filesystem::path file_ = std::filesystem::temp_directory_path() /
                                ("tendril_controls_test." + std::to_string(::getpid()) + ".json");
  GripperLimits limits_{.grasps = {Grasp::both, Grasp::first}};
};

TEST_F(Controls, AreReadInOrder) {
  const std::vector<Control> controls = read(kControls);
  ASSERT_EQ(controls.size(), 2u);
  EXPECT_EQ(controls[0].start_s, 0.0);
  EXPECT_EQ(controls[0].end_s, 1.2);
  EXPECT_EQ(controls[0].moving, End::first);
  EXPECT_TRUE(controls[0].isHeld(End::first) && controls[0].isHeld(End::last));
  EXPECT_EQ(controls[0].target.position, Vector3(1, 2, 3));
  EXPECT_EQ(controls[0].target.rotation.y(), 1.0);
  EXPECT_FALSE(controls[1].moving);
  EXPECT_TRUE(controls[1].isHeld(End::first));
  EXPECT_FALSE(controls[1].isHeld(End::last));
}

TEST_F(Controls, WrittenAndReadAgainAreTheSame) {
  const std::vector<Control> controls = read(kControls);
  nlohmann::json list = nlohmann::json::array();
  for (const Control& control : controls) list.emplace_back(toJson(control));
  const std::vector<Control> again = controlsFromJson(list, "solution.json: controls");
  ASSERT_EQ(again.size(), controls.size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(toJson(again[i]).dump(), toJson(controls[i]).dump());
    EXPECT_EQ(again[i].held, controls[i].held);
    EXPECT_EQ(again[i].moving, controls[i].moving);
  }
}

TEST_F(Controls, ErrorsNameTheLineAndTheControl) {
  EXPECT_EQ(messageFor(R"("start_s": 1.2)", R"("start_s": 1.3)"),
            ":4: controls[1].start_s is 1.3; it must be 1.2, where the control before it ends.");
  EXPECT_EQ(messageFor(R"("start_s": 0.0)", R"("start_s": 0.1)"),
            ":2: controls[0].start_s is 0.1; it must be 0, the beginning.");
  EXPECT_EQ(messageFor(R"("end_s": 1.5)", R"("end_s": 1.2)"),
            ":4: controls[1].end_s is 1.2; a control must end after it starts.");
  EXPECT_EQ(
      messageFor(R"("held": ["first"])", R"("held": ["last"])"),
      ":4: controls[1].held means the grasp \"last\", which the scenario's grippers.grasps do not allow.");
  EXPECT_EQ(messageFor(R"("held": ["first"])", R"("held": [])"),
            ":4: controls[1].held has no values; at least one end must be held.");
  EXPECT_EQ(messageFor(R"("held": ["first"])", R"("held": ["first", "first"])"),
            ":4: controls[1].held[1] is \"first\"; it stands there twice; keep one.");
  EXPECT_EQ(messageFor(R"("moving": null)", R"("moving": "last")"),
            ":4: controls[1].target is missing; add it.");
  EXPECT_EQ(
      messageFor(R"("moving": "first", "held": ["first", "last"])", R"("moving": "last", "held": ["first"])"),
      ":2: controls[0].moving is \"last\"; an end that moves must be held.");
  EXPECT_EQ(messageFor(R"("moving": "first")", R"("moving": "frist")"),
            ":2: controls[0].moving is \"frist\"; did you mean \"first\"?");
  EXPECT_EQ(messageFor(R"([0, 0, 1, 0])", R"([0, 0, 2, 0])"),
            ":3: controls[0].target.orientation_wxyz has length 2; a unit quaternion [w, x, y, z] has length "
            "1, to within "
            "0.001.");
  EXPECT_EQ(messageFor("\"controls\"", "\"control\""),
            ":1: unknown key \"control\"; did you mean \"controls\"?");
}

TEST_F(Controls, AnEmptyListIsNoPlan) {
  EXPECT_THROW((void)read(R"({"controls": []})"), InputError);
  EXPECT_THROW((void)read(R"({})"), InputError);
}

}  // namespace
}  // namespace tendril
