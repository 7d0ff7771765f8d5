// Where the path behind the vehicle is cut.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A node of the path, as far as cuts depend on it.
struct CutNode {
  double along_m = 0.0;  ///< Path of the vehicle up to it.
  double heading_rad = 0.0;
  /// Samples of the thesis that the node stands for: its scans. 0: it is no longer in the graph,
  /// and counts for nothing but its place on the path.
  std::uint32_t scans = 0;
  std::uint32_t landmarks = 0;      ///< That it observed.
  std::uint32_t new_landmarks = 0;  ///< Of these, those that no earlier node of the stretch did.
  /// Whether it observed nothing, or is known where it is relative to the last node that observed
  /// something. Else a stretch ends before it, by whatever policy: an error that all landmarks
  /// behind the gap have in common would count as one of each.
  bool is_tied = true;
};

/// Where a stretch of the path ends (thesis on submaps §3.4.1, §5.3, §6.1). Zero: no such rule.
struct CutPolicy {
  double distance_m = 0.0;  ///< A stretch is so long, or longer where a rule below makes it wait.
  double sparse = 0.0;      ///< It waits until fewer landmarks than this are observed ...
  double dense = 0.0;       ///< ... or until more than this are ...
  double turn_rad = 0.0;    ///< ... or until the heading has changed by so much within kTurn_m.
  double longest_m = 0.0;   ///< It waits no longer than this.
  std::size_t size = 0;     ///< It ends with so many nodes and landmarks together.

  /// Scans over which the number of landmarks is averaged (thesis §5.3).
  static constexpr std::uint32_t kSamples = 16;
  /// Path within which a turn is sharp [m].
  static constexpr double kTurn_m = 15.0;
  /// Fewest nodes of a stretch that does not end at a gap.
  static constexpr std::size_t kLeastNodes = 4;
};

/// The policy that the parameters give, with a sensor of this range [m].
CutPolicy cut_policy(const SmoothingMapperParameters& parameters, double range_m);

/// Number of nodes of the first stretch; none while it is not complete, for which the node after it
/// must be there. `nodes` begins with the stretch, in order of time. The rules are asked at the
/// last node of the stretch. Linear in the nodes.
std::optional<std::size_t> first_stretch(std::span<const CutNode> nodes, const CutPolicy& policy);

}  // namespace understory::geoslam_mapper::smoothing
