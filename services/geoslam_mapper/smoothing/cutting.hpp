// Cuts of the path behind the vehicle into stretches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A node of the path, with the quantities that cuts depend on.
struct CutNode {
  double along_m = 0.0;  ///< Path length of the vehicle up to it.
  double heading_rad = 0.0;
  /// Number of scans of the node (samples of the thesis). 0: the node is no longer in the graph and
  /// counts only by its place on the path.
  std::uint32_t scans = 0;
  std::uint32_t landmarks = 0;  ///< Number of landmarks that it observed.
  std::uint32_t new_landmarks =
      0;  ///< Of these, the number that no earlier node of the stretch observed.
  /// The node observed nothing, or its pose is known relative to the last node that observed
  /// something. If false, a stretch ends before it, whatever the policy: all landmarks behind the
  /// gap share one error, which would count as an independent error of each.
  bool is_tied = true;
};

/// Rules for the end of a stretch of the path (thesis on submaps §3.4.1, §5.3, §6.1). Zero: no such
/// rule.
struct CutPolicy {
  double distance_m = 0.0;  ///< Least length of a stretch; the rules below may lengthen it.
  double sparse = 0.0;      ///< The end waits until fewer landmarks than this are observed ...
  double dense = 0.0;       ///< ... or until more than this are ...
  double turn_rad = 0.0;    ///< ... or until the heading has changed by this within kTurn_m.
  double longest_m = 0.0;   ///< Longest stretch: the end waits no longer.
  std::size_t size = 0;     ///< The stretch ends with this number of nodes and landmarks together.

  /// Scans over which the number of landmarks is averaged (thesis §5.3).
  static constexpr std::uint32_t kSamples = 16;
  /// Length of path over which a turn is measured [m].
  static constexpr double kTurn_m = 15.0;
  /// Fewest nodes of a stretch that does not end at a gap.
  static constexpr std::size_t kLeastNodes = 4;
};

/// The policy from the parameters, for a sensor of this range [m].
CutPolicy cut_policy(const SmoothingMapperParameters& parameters, double range_m);

/// Number of nodes of the first stretch; none while it is incomplete: the node after it must exist.
/// `nodes` begins with the stretch, in order of time. The rules are applied at the last node of the
/// stretch. Linear in the nodes.
std::optional<std::size_t> first_stretch(std::span<const CutNode> nodes, const CutPolicy& policy);

}  // namespace understory::geoslam_mapper::smoothing
