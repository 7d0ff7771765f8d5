// Geometries of GeoJSON from longitude and latitude [deg], as RFC 7946 wants them at the date line.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

namespace understory::cli {

/// Longitude and latitude [deg], one after another; neighbours are less than half the earth apart.
using PlacesDeg = std::vector<Eigen::Vector2d>;

/// To nine decimals: 0.1 mm.
nlohmann::ordered_json point_geometry(const Eigen::Vector2d& place_deg);
/// A LineString; cut in two (MultiLineString) where it crosses the date line (RFC 7946, 3.1.9).
nlohmann::ordered_json line_geometry(const PlacesDeg& places);
/// A Polygon of the ring's corners, of which none comes twice; likewise (MultiPolygon).
nlohmann::ordered_json polygon_geometry(const PlacesDeg& corners);

}  // namespace understory::cli
