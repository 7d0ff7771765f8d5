#include "common/wire/convert.hpp"
#include "common/wire/convert_shared.hpp"

namespace understory::wire {

Result<model::PlaceScan> from_wire(const place_scan_t& wire) {
  Checks checks;
  checks.range("num_points", wire.num_points, 0.0,
               static_cast<double>(model::PlaceScan::kMostPoints));
  if (checks.refusal()) return *checks.refusal();

  model::PlaceScan scan;
  take_stamp(wire, scan);
  scan.points.reserve(wire.x_cm.size());
  for (std::size_t i = 0; i < wire.x_cm.size(); ++i)
    scan.points.push_back({wire.x_cm[i], wire.y_cm[i], wire.z_cm[i]});
  return scan;
}

place_scan_t to_wire(const model::PlaceScan& scan) {
  place_scan_t wire{};
  put_stamp(scan, wire);
  wire.num_points = static_cast<std::int32_t>(scan.points.size());
  for (const model::PlacePoint& point : scan.points) {
    wire.x_cm.push_back(point.x_cm);
    wire.y_cm.push_back(point.y_cm);
    wire.z_cm.push_back(point.z_cm);
  }
  return wire;
}

}  // namespace understory::wire
