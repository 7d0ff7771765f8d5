// Simulated forests (GeoSLAM §4.5.2) and surveyed ones.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

namespace understory::sim {

/// Trunks in the frame `world`.
struct Forest {
  Eigen::Vector2d low_m = Eigen::Vector2d::Zero();   ///< Corner of the extent.
  Eigen::Vector2d high_m = Eigen::Vector2d::Zero();  ///< Opposite corner.
  std::vector<Eigen::Vector2d> trunks_m;
  std::vector<double> radii_m;  ///< As many as trunks; 0 where unknown.
};

/// The three forests of GeoSLAM Table 4.4.
enum class ForestKind { kDense, kIntermediate, kSparse };

/// Density and regularity of the trunks.
struct ForestParameters {
  double side_m = 1000.0;
  double min_distance_m = 7.0;  ///< Of the Poisson-disc points, before the jitter.
  double jitter_sigma_m = 3.0;  ///< Per axis.
  int tries = 30;               ///< k of Bridson's algorithm.
  /// Number of tiles searched to each side for points too near. 1 as in GeoSLAM (Fig. 4.6): it
  /// misses some and gives 7 % more trees. 2 is the correct algorithm.
  int tile_reach = 1;
  double trunk_radius_m = 0.0;
};

/// The parameters of GeoSLAM Table 4.4.
ForestParameters forest_parameters(ForestKind kind);
/// "dense", "intermediate", "sparse".
std::string_view to_string(ForestKind kind);
/// The kind with this name; none for another.
std::optional<ForestKind> forest_kind(std::string_view name);
/// All names accepted by forest_kind().
std::vector<std::string> forest_names();

/// Poisson-disc points (Bridson 2007) in the square [0, side]^2, each then displaced by Gaussian
/// jitter, possibly out of the square.
Forest make_forest(const ForestParameters& parameters, std::mt19937_64& random);

/// A surveyed forest, or the error.
struct StemMapResult {
  Forest forest;
  std::string error;  ///< Empty if valid; else the error, with the line.
};
/// A surveyed stem map from the text of a CSV file with the header x_m,y_m or x_m,y_m,dbh_m
/// (diameter at breast height); further columns, empty lines and lines that start with # are
/// ignored. Refused with line and column: values that are no numbers, coordinates beyond 1e8 m or
/// farther than 200 km from the first row's, diameters beyond 20 m.
StemMapResult parse_stem_map(std::string_view csv);

}  // namespace understory::sim
