// Coordinate reference systems by name, and local frames in them.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/model/map_reference.hpp"

namespace understory::reference_system {

/// An error in one line with the reference system or the coordinates.
class ReferenceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A position by latitude and longitude [deg].
struct Geographic {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
};

/// Properties of a reference system.
struct SystemSummary {
  std::string code;            ///< Code in its registry (EPSG:25832), else its name.
  std::string name;            ///< ETRS89 / UTM zone 32N
  bool is_geographic = false;  ///< Coordinates are longitude and latitude.
  double unit = 1.0;  ///< Unit of its coordinates in metres, or in degrees if it is geographic.
};

/// Looks a horizontal system up by code, name or well-known text; of a compound system the
/// horizontal part is used. Throws ReferenceError for a system that is unknown, vertical,
/// geocentric, engineering, bound to a transformation, or has axes other than east and north. Some
/// milliseconds.
SystemSummary summary_of(const std::string& system);

/// Transforms coordinates between two systems, in the units of each. The first coordinate is
/// easting or longitude, the second northing or latitude, independent of the order in the registry.
class Transformation {
 public:
  /// Systems by code, name or well-known text. `near`: a position near the coordinates (WGS 84),
  /// which selects one of several transformations between two datums. Throws ReferenceError.
  Transformation(const std::string& from, const std::string& to,
                 const std::optional<Geographic>& near = std::nullopt);
  ~Transformation();
  Transformation(Transformation&&) noexcept;
  Transformation& operator=(Transformation&&) = delete;

  /// Transforms to the second system. Throws ReferenceError where the coordinates are outside of
  /// it. About a microsecond.
  Eigen::Vector2d forward(const Eigen::Vector2d& from) const;
  /// Transforms to the first system.
  Eigen::Vector2d inverse(const Eigen::Vector2d& to) const;
  /// Accuracy of the transformation between the two datums [m]; 0 for one datum, none where
  /// unknown. Call forward() first.
  std::optional<double> accuracy_m() const;

 private:
  struct Parts;
  Eigen::Vector2d moved(const Eigen::Vector2d& at, bool is_forward) const;
  std::unique_ptr<Parts> parts_;
};

/// The frame with its origin at these coordinates of the system (easting and northing, or longitude
/// and latitude, in its units), rounded to 0.01 mm: x points `rotation_rad` to the left of east,
/// one metre is one metre on the ellipsoid at the origin; at a distance d the scale is 1 + d^2/(2
/// R^2) (error 1.2e-6 at 10 km). Throws ReferenceError.
model::MapReference frame_at(const std::string& system, const Eigen::Vector2d& origin,
                             double rotation_rad = 0.0);

/// Transformation from a system to metres of a map's frame.
Transformation into_frame(const std::string& system, const model::MapReference& frame);
/// Transformation from metres of a map's frame to longitude and latitude [deg] of WGS 84.
Transformation to_wgs84(const model::MapReference& frame);

/// A position outside the area of use of a system.
struct OutsideArea {
  double distance_m = 0.0;  ///< Distance from the area, by its bounds of latitude and longitude.
  std::string text;         ///< Description for people.
};
/// Checks a position, e.g. for swapped columns; none where it is in the area, or the system states
/// no area.
std::optional<OutsideArea> outside_area(const std::string& system, const Eigen::Vector2d& at);

}  // namespace understory::reference_system
