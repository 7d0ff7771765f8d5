// The ways to cut a map that are compared, and what the thesis got with them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/cutting.hpp"

namespace understory::eval::experiments::partition {

/// A way to cut.
struct Policy {
  std::string name;        ///< "uncut", "distance", "sparse", "dense", "turn", "size".
  double size_m = 0.0;     ///< Distance after which a cut is due.
  double threshold = 0.0;  ///< Landmarks, degrees, or nodes and landmarks; by name.

  /// As the tables name it, e.g. "sparse < 2".
  std::string label() const;
  /// For the baseline.
  geoslam_mapper::smoothing::CutPolicy cuts() const;
  /// For the mapper: sets the parameters that are the policy's.
  void set(geoslam_mapper::SmoothingMapperParameters& parameters) const;
};

/// Submaps of these sizes (thesis on submaps §5.1, §5.2).
std::vector<Policy> static_policies(const std::vector<double>& sizes_m);
/// Submaps of 100 m that wait for few (< 1, 2, 3) or many (> 4, 5, 6) landmarks (§5.3, §5.4) or for
/// a sharp turn (§6.1), and submaps of a size in nodes and landmarks.
std::vector<Policy> dynamic_policies();

/// A row of the thesis's Tables 5.1 to 5.6.
struct Published {
  double rmse_m = 0.0;
  std::optional<double> partition_ms;
  std::optional<double> iteration_ms;
  std::optional<double> mean_submap_m;
};
/// What the thesis got on its route; none where it has no such row. The closed tables are against
/// the reference, the others against the uncut map.
std::optional<Published> published(const std::string& route, const Policy& policy, bool is_closed);

}  // namespace understory::eval::experiments::partition
