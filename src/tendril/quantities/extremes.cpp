#include "tendril/quantities.h"

namespace tendril {
namespace {

/// Keeps the candidate if it is the largest so far; `sign` -1 looks for the smallest.
class Search {
 public:
  Search(const char* name, double sign) : name_(name), sign_(sign) {}
  void see(double value, double time, std::optional<double> s) {
    if (!found_ || sign_ * value > sign_ * found_->value) found_ = {name_, value, time, s};
  }
  void addTo(std::vector<Extreme>& out) const {
    if (found_) out.push_back(*found_);
  }

 private:
  const char* name_;
  double sign_;
  std::optional<Extreme> found_;
};

}  // namespace

std::vector<Extreme> extremes(std::span<const Quantities> motion, const RodProperties& rod) {
  Search radius("smallest_bend_radius_m", -1), tension("largest_tension_n", 1),
      compression("largest_compression_n", 1), moment("largest_internal_moment_n_m", 1),
      grip_force("largest_gripper_force_n", 1), grip_moment("largest_gripper_moment_n_m", 1),
      contact("largest_contact_force_n", 1), clearance("smallest_clearance_m", -1);
  for (const Quantities& q : motion) {
    if (q.bend_radius) radius.see(*q.bend_radius, q.time, q.bend_radius_s);
    for (std::size_t k = 0; k < q.internal_force.size(); ++k) {
      const double s = (static_cast<double>(k) + 0.5) * rod.elementLength(), n = q.internal_force[k].x();
      if (n > 0) tension.see(n, q.time, s);
      if (n < 0) compression.see(-n, q.time, s);
      moment.see(q.internal_moment[k].norm(), q.time, s);
    }
    for (const End end : kBothEnds) {
      const auto e = static_cast<std::size_t>(end);
      const double s = end == End::first ? 0 : rod.length, force = q.gripper_force[e].norm(),
                   torque = q.gripper_moment[e].norm();
      if (force > 0) grip_force.see(force, q.time, s);
      if (torque > 0) grip_moment.see(torque, q.time, s);
    }
    for (const ContactForce& c : q.contacts) contact.see(c.force.norm(), q.time, c.s);
    for (const SelfContactForce& c : q.self_contacts) contact.see(c.force.norm(), q.time, c.s[0]);
    if (q.clearance) clearance.see(*q.clearance, q.time, {});
  }
  std::vector<Extreme> out;
  for (const Search* search :
       {&radius, &tension, &compression, &moment, &grip_force, &grip_moment, &contact, &clearance})
    search->addTo(out);
  return out;
}

}  // namespace tendril
