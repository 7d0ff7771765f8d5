// The thesis's way to partition a map (thesis on submaps §2.3.3, §3.4): the recorded graph of a
// drive is cut, each submap is optimised by itself and condensed, the condensed graph is solved,
// and the submaps are expanded. All offline, beside the mapper's own way.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "common/factor_graph/plane/graph.hpp"
#include "eval/experiments/partition/compounding.hpp"
#include "services/geoslam_mapper/smoothing/cutting.hpp"
#include "services/geoslam_mapper/smoothing/expansion.hpp"

namespace understory::eval::experiments::partition {

/// The graph of a drive that was not cut; poses in order of time, the first one held.
using DriveGraph = geoslam_mapper::smoothing::ExpandedDrive;

/// How the covariances of what is shared are kept.
enum class Condensed : std::uint8_t {
  kSingly,  ///< One measurement for each shared node (§3.4.2): what they share is counted as noise.
  kJointly,  ///< One measurement of all of them, with their joint covariance.
};

/// Which landmarks two submaps share. The poses at the cuts are always shared.
enum class Shared : std::uint8_t {
  kAtCut,  ///< Those observed from the pose at the cut and from the next one (§3.4.1).
  kAll,    ///< All that both observed: what was missed once is not lost.
};

/// One way to do it.
struct BaselineOptions {
  geoslam_mapper::smoothing::CutPolicy policy;
  Propagation propagation = Propagation::kCompounding;
  Condensed condensed = Condensed::kSingly;
  Shared shared = Shared::kAtCut;
  /// Manual loop closure (§3.4.3): where the last pose is, in the frame of the first one.
  std::optional<geometry::SE2> first_T_last;
  bool also_full = false;  ///< Optimises the full graph from the expanded one.
};

/// What it gave. Poses are in the order of the drive's graph.
struct BaselineSolution {
  std::vector<std::size_t> cuts;  ///< Poses at which the path was cut.
  /// Each submap begins where the one before ended, and nothing else ties them (§5.1, §5.3: what
  /// was driven before a cut is not changed by what comes after it).
  std::vector<geometry::SE2> chained;
  /// The condensed graph solved, and each submap optimised with what it shares held there (§3.4.3).
  std::vector<geometry::SE2> expanded;
  std::vector<geometry::SE2> full;  ///< Of the full graph; empty unless asked for.
  double partition_ms = 0.0;        ///< Mean time to optimise and condense one submap.
  double iteration_ms = 0.0;     ///< Mean time of an incremental update with the pose's own submap.
  double closure_s = 0.0;        ///< Condensed graph and expansion.
  std::size_t stored_bytes = 0;  ///< Of all submaps: factors and estimates, as doubles.
};

/// Indices of the poses at which the policy cuts, in order; the first and the last are no cuts.
std::vector<std::size_t> cuts_of(const DriveGraph& drive,
                                 const geoslam_mapper::smoothing::CutPolicy& policy);
/// Mean number of landmarks over the last 16 scans, at each pose.
std::vector<double> mean_landmarks(const DriveGraph& drive);

/// Partitions the drive. Throws std::runtime_error where a submap or the condensed graph leaves a
/// variable undetermined.
BaselineSolution solve_by_submaps(const DriveGraph& drive, const BaselineOptions& options);

}  // namespace understory::eval::experiments::partition
