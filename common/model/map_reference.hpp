// Location of a map's frame on the earth.
#pragma once

#include <string>

namespace understory::model {

/// Location of the frame `map` on the earth: a conformal projection with its origin at the point
/// (0, 0), where a metre of the frame is a metre on the ellipsoid. The definition is complete; the
/// other values are for people.
struct MapReference {
  std::string system;          ///< Reference system of the survey, e.g. EPSG:25832.
  double latitude_deg = 0.0;   ///< Latitude of the origin, on the datum of `system`.
  double longitude_deg = 0.0;  ///< Longitude from Greenwich, on the datum of `system`.
  double rotation_rad = 0.0;   ///< Angle from east to the x axis, counterclockwise, at the origin.
  std::string definition;      ///< Well-known text of the frame (WKT 1, in GDAL's form).

  bool operator==(const MapReference&) const = default;
};

}  // namespace understory::model
