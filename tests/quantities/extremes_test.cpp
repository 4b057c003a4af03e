#include <gtest/gtest.h>

#include <sstream>

#include "tendril/quantities.h"

namespace tendril {
namespace {

TEST(Extremes, SayHowMuchWhenAndWhere) {
  RodProperties rod;
  rod.length = 2, rod.elements = 2;
  std::vector<Quantities> motion(2);
  for (std::size_t k = 0; k < 2; ++k) {
    motion[k].time = static_cast<double>(k + 1);
    motion[k].internal_force.assign(2, Vector3(3, 9, 9));
    motion[k].internal_moment.assign(2, Vector3(0, 0, 0));
  }
  motion[0].bend_radius = 0.3, motion[0].bend_radius_s = 0.5;
  motion[1].bend_radius = 0.2, motion[1].bend_radius_s = 1.5;
  motion[1].internal_force[1] = {-5, 0, 0};
  motion[0].internal_moment[1] = {0, 3, 4};
  motion[1].gripper_force[1] = {0, 0, -7};
  motion[0].contacts = {{0.7, Vector3::Zero(), {0, 2, 0}}};
  std::vector<std::string> lines;
  for (const Extreme& e : extremes(motion, rod)) {
    std::ostringstream line;
    line << e.name << " " << e.value << " " << e.time << " " << e.s.value_or(-1);
    lines.push_back(line.str());
  }
  EXPECT_EQ(lines,
            (std::vector<std::string>{"smallest_bend_radius_m 0.2 2 1.5", "largest_tension_n 3 1 0.5",
                                      "largest_compression_n 5 2 1.5", "largest_internal_moment_n_m 5 1 1.5",
                                      "largest_gripper_force_n 7 2 2", "largest_contact_force_n 2 1 0.7"}));
}

}  // namespace
}  // namespace tendril
