// Geometries of GeoJSON from longitude and latitude [deg], split at the date line as in RFC 7946.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

namespace understory::cli {

/// Positions by longitude and latitude [deg]; neighbours are less than half the earth apart.
using PlacesDeg = std::vector<Eigen::Vector2d>;

/// A Point with nine decimals (0.1 mm).
nlohmann::ordered_json point_geometry(const Eigen::Vector2d& place_deg);
/// A LineString; cut in two (MultiLineString) where it crosses the date line (RFC 7946, 3.1.9).
nlohmann::ordered_json line_geometry(const PlacesDeg& places);
/// A Polygon of the ring's corners, none repeated; likewise cut (MultiPolygon).
nlohmann::ordered_json polygon_geometry(const PlacesDeg& corners);

}  // namespace understory::cli
