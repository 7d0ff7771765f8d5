// Where the frame of a map lies on the earth.
#pragma once

#include <string>

namespace understory::model {

/// The place of the frame `map` on the earth: a conformal projection whose point (0, 0) is the
/// origin, where a metre of the frame is a metre on the ellipsoid. Its definition says all of it;
/// the other values are for people.
struct MapReference {
  std::string system;          ///< Reference system of the survey, e.g. EPSG:25832.
  double latitude_deg = 0.0;   ///< Of the origin, on the datum of `system`.
  double longitude_deg = 0.0;  ///< From Greenwich, on the datum of `system`.
  double rotation_rad = 0.0;   ///< From east to the x axis, counterclockwise, at the origin.
  std::string definition;      ///< Well-known text (WKT 1, as GDAL writes it) of the frame.

  bool operator==(const MapReference&) const = default;
};

}  // namespace understory::model
