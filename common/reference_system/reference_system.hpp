// Coordinate reference systems by name, and local frames that lie in them.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/model/map_reference.hpp"

namespace understory::reference_system {

/// One line that names the reference system or the coordinates.
class ReferenceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A place by latitude and longitude [deg].
struct Geographic {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
};

/// What is known of a reference system.
struct SystemSummary {
  std::string code;            ///< As its registry has it (EPSG:25832), else its name.
  std::string name;            ///< ETRS89 / UTM zone 32N
  bool is_geographic = false;  ///< Coordinates are longitude and latitude.
  double unit = 1.0;           ///< Of its coordinates: metres, or degrees where it is geographic.
};

/// Looks a horizontal system up by code, name or well-known text; of a compound one the horizontal
/// part counts. Throws ReferenceError for what is unknown, vertical, geocentric, engineering, bound
/// to a transformation, or has axes other than east and north. Some milliseconds.
SystemSummary summary_of(const std::string& system);

/// Coordinates of one system as those of another, in the units of each. The first one is easting or
/// longitude, the second one northing or latitude, whatever order the registry states.
class Transformation {
 public:
  /// Systems by code, name or well-known text. `near`: where the coordinates lie (WGS 84), by which
  /// one of several transformations between two datums is chosen. Throws ReferenceError.
  Transformation(const std::string& from, const std::string& to,
                 const std::optional<Geographic>& near = std::nullopt);
  ~Transformation();
  Transformation(Transformation&&) noexcept;
  Transformation& operator=(Transformation&&) = delete;

  /// In the second system. Throws ReferenceError where the coordinates have no place there. About a
  /// microsecond.
  Eigen::Vector2d forward(const Eigen::Vector2d& from) const;
  /// In the first system.
  Eigen::Vector2d inverse(const Eigen::Vector2d& to) const;
  /// How well the two datums are known to each other [m]; 0 for one datum, none where it is not
  /// known. Call forward() first.
  std::optional<double> accuracy_m() const;

 private:
  struct Parts;
  Eigen::Vector2d moved(const Eigen::Vector2d& at, bool is_forward) const;
  std::unique_ptr<Parts> parts_;
};

/// The frame whose origin lies at these coordinates of the system (easting and northing, or
/// longitude and latitude, in its units), rounded to 0.01 mm: x points `rotation_rad` to the left
/// of east, one metre is one metre on the ellipsoid at the origin and 1 + d^2/(2 R^2) of it at a
/// distance d (1.2e-6 at 10 km). Throws ReferenceError.
model::MapReference frame_at(const std::string& system, const Eigen::Vector2d& origin,
                             double rotation_rad = 0.0);

/// Coordinates of a system to metres of a map's frame.
Transformation into_frame(const std::string& system, const model::MapReference& frame);
/// Metres of a map's frame to longitude and latitude [deg] of WGS 84.
Transformation to_wgs84(const model::MapReference& frame);

/// A place that is not in the area for which a system is made.
struct OutsideArea {
  double distance_m = 0.0;  ///< From the area, by its bounds of latitude and longitude.
  std::string text;         ///< What it is, for people.
};
/// E.g. since the columns are swapped; none where the place is in the area, or the system states
/// none.
std::optional<OutsideArea> outside_area(const std::string& system, const Eigen::Vector2d& at);

}  // namespace understory::reference_system
