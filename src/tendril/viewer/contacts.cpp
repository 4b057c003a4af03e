#include "contacts.h"

#include <algorithm>

namespace tendril::viewer {
namespace {

/// The contacts of one shape are appended to `points`, one per place: neighbouring segments share theirs at
/// the node between them. Returns the smallest gap [m], infinite if beyond reach.
double contactsOf(const RodShape& shape, const Obstacles& obstacles, double radius, double contact_distance,
                  double reach, std::vector<float>& points) {
  double smallest = std::numeric_limits<double>::infinity();
  Vector3 last = Vector3::Constant(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i + 1 < shape.size(); ++i) {
    const std::array<Vector3, 2> segment = {shape[i].position, shape[i + 1].position};
    const Obstacles::Clearance found = obstacles.clearance(segment, radius + reach);
    const double gap = found.distance - radius;
    smallest = std::min(smallest, gap);
    if (gap > contact_distance || (found.on_mesh - last).norm() < 0.25 * radius) continue;
    last = found.on_mesh;
    for (int axis = 0; axis < 3; ++axis) points.push_back(static_cast<float>(last[axis]));
  }
  return smallest;
}

}  // namespace

Contacts findContacts(const Solution& solution, const Obstacles& obstacles, std::size_t most_segments) {
  const double radius = solution.scenario.rod.radius;
  const double contact_distance = solution.scenario.simulation.contact_distance;
  const std::vector<RodShape>& shapes = solution.trajectory.shapes;
  Contacts contacts;
  contacts.reach = std::max(contact_distance, radius);
  contacts.offsets.push_back(0);
  if (shapes.empty()) return contacts;

  const std::size_t segments = shapes.size() * (shapes.front().size() - 1);
  const std::size_t stride = std::max<std::size_t>(1, (segments + most_segments - 1) / most_segments);
  contacts.stride = static_cast<int>(stride);
  for (std::size_t k = 0; k < shapes.size(); k += stride) {
    const double gap =
        contactsOf(shapes[k], obstacles, radius, contact_distance, contacts.reach, contacts.points);
    contacts.gaps.push_back(static_cast<float>(gap));
    contacts.offsets.push_back(static_cast<std::uint32_t>(contacts.points.size() / 3));
  }
  return contacts;
}

}  // namespace tendril::viewer
